//! The truth about refractive objects that `scene.json` states: it is written for our scenes, and read for ours and for
//! the path-traced ones.

use super::cameras::Elevations;
use super::medium::{Index, Medium};
use super::scene::{Body, Environment, Matter, Scene};
use super::shape::Shape;
use super::texture::Texture;
use crate::{DataError, json};
use refraxel_core::{Aabb, Vec3};
use serde_json::{Map, Value, json};
use std::path::Path;

/// The refractive index of a scene as a function of position.
///
/// Built from `scene.json`; its media and shapes are those of the tracer, so nothing is sampled or rounded.
#[derive(Clone, Debug)]
pub struct IndexTruth {
    scene: Scene,
}

impl IndexTruth {
    /// Reads a `scene.json`; `None` where it has no such list as [`IndexTruth::from_scene_json`] understands.
    ///
    /// Errors: the file cannot be read, is too large, or is not JSON (`NaN` and `Infinity`, which Python writes, are
    /// understood).
    pub fn read(path: &Path) -> Result<Option<IndexTruth>, DataError> {
        Ok(Self::from_scene_json(&json::read(path)?))
    }

    /// Reads the list `refractive` (and `opaque`, where there is one) of a `scene.json`.
    ///
    /// It understands our own entries (keys `region` and `index`) and those of the path-traced scenes: `shape` sphere
    /// (`center`, `radius`, `ior`), box (`min`, `max`, `ior`) and luneburg (`center`, `radius`). Later entries lie
    /// inside earlier ones. `None` when there is no such list, it is empty, or an entry is of another kind.
    pub fn from_scene_json(json: &Value) -> Option<IndexTruth> {
        let list = json.get("refractive")?.as_array()?;
        let mut bodies: Vec<Body> =
            list.iter().enumerate().map(|(i, entry)| body_of(entry, i)).collect::<Option<_>>()?;
        if bodies.is_empty() {
            return None;
        }
        for entry in json.get("opaque").and_then(Value::as_array).into_iter().flatten() {
            let shape = serde_json::from_value(entry.clone()).ok()?;
            bodies.push(Body::opaque("opaque", shape, Texture::Plain([0.0; 3])));
        }
        Some(IndexTruth::from_bodies(bodies))
    }

    /// The truth of a scene; `None` for one without refractive bodies.
    pub fn of_scene(scene: &Scene) -> Option<IndexTruth> {
        scene
            .bodies
            .iter()
            .any(|b| b.medium().is_some())
            .then(|| IndexTruth::from_bodies(scene.bodies.clone()))
    }

    fn from_bodies(bodies: Vec<Body>) -> IndexTruth {
        let environment = Environment::Constant([1.0; 3]);
        let (name, shows) = (String::new(), String::new());
        let (bounds, elevations) = (Scene::usual_bounds(), Elevations::UPPER);
        IndexTruth { scene: Scene { name, shows, bodies, environment, bounds, elevations } }
    }

    /// The refractive index at a world position; 1 in air, and undefined (that of its surroundings) in opaque bodies.
    pub fn n(&self, x: Vec3<f64>) -> f64 {
        self.scene.index_at(x)
    }

    /// True inside of the visible part of a refractive body; false in an air bubble in glass.
    pub fn is_inside(&self, x: Vec3<f64>) -> bool {
        self.signed_distance_like(x) < 0.0
    }

    /// True inside of an opaque body, where no ray needs the index.
    pub fn is_opaque(&self, x: Vec3<f64>) -> bool {
        self.scene.bodies.iter().any(|b| b.medium().is_none() && b.shape.contains(x))
    }

    /// Distance to the border of the refractive region, negative inside: exact near smooth surfaces, a lower bound
    /// elsewhere (edges, overlaps) [scene unit].
    pub fn signed_distance_like(&self, x: Vec3<f64>) -> f64 {
        let mut bodies: Vec<(u32, &Body, bool)> = self.media().collect();
        bodies.sort_by_key(|&(priority, _, _)| priority);
        bodies.iter().fold(f64::INFINITY, |d, &(_, body, is_air)| {
            let f = body.visible_shape().surface(x).0;
            if is_air { d.max(-f) } else { d.min(f) }
        })
    }

    /// The box of all refractive bodies (of their visible parts).
    pub fn bounding_box(&self) -> Aabb<f64> {
        let mut all = Aabb::empty();
        for (_, body, _) in self.media().filter(|m| !m.2) {
            let b = body.visible_shape().bounds();
            all.include(b.min);
            all.include(b.max);
        }
        all
    }

    /// Refractive bodies with their priority, and whether they are bubbles of air.
    fn media(&self) -> impl Iterator<Item = (u32, &Body, bool)> {
        self.scene.bodies.iter().filter_map(|b| match &b.matter {
            Matter::Refractive { medium, priority, .. } => {
                Some((*priority, b, medium.index == Index::Constant { ior: 1.0 }))
            }
            Matter::Opaque(_) | Matter::Glazed(..) => None,
        })
    }

    /// The refractive bodies as a list in which the later one rules where several overlap; `None` if one of them has an index
    /// that varies, or no visible border.
    pub fn constant_bodies(&self) -> Option<Vec<ConstantBody<'_>>> {
        let mut all = Vec::new();
        for body in &self.scene.bodies {
            let Matter::Refractive { medium, priority, visible } = &body.matter else { continue };
            let Index::Constant { ior: index } = medium.index else { return None };
            if visible.is_some() {
                return None;
            }
            all.push((*priority, ConstantBody { index, shape: &body.shape }));
        }
        // Stable: of equal priority the later body rules.
        all.sort_by_key(|(priority, _)| *priority);
        Some(all.into_iter().map(|(_, body)| body).collect())
    }

    /// n at the centres of the cells of a grid over `bounds`, z fastest, x slowest.
    pub fn voxels(&self, bounds: &Aabb<f64>, cells: [usize; 3]) -> Vec<f32> {
        use rayon::prelude::*;
        let e = bounds.extent();
        let at = |a: usize, i: usize| bounds.min[a] + e[a] * (i as f64 + 0.5) / cells[a] as f64;
        (0..cells[0] * cells[1])
            .into_par_iter()
            .flat_map_iter(|ij| {
                let (x, y) = (at(0, ij / cells[1]), at(1, ij % cells[1]));
                (0..cells[2]).map(move |k| self.n(Vec3::new(x, y, at(2, k))) as f32)
            })
            .collect()
    }
}

/// A refractive body of one index.
#[derive(Clone, Copy, Debug)]
pub struct ConstantBody<'a> {
    /// Its index n [1].
    pub index: f64,
    /// Where it is.
    pub shape: &'a Shape,
}

fn body_of(entry: &Value, position: usize) -> Option<Body> {
    let read = |key: &str| entry.get(key).cloned();
    let number = |key: &str| entry.get(key).and_then(Value::as_f64);
    let priority = number("priority").map_or(position as u32 + 1, |p| p as u32);
    let (shape, index) = if let (Some(region), Some(index)) = (read("region"), read("index")) {
        (serde_json::from_value(region).ok()?, serde_json::from_value(index).ok()?)
    } else if entry.get("shape")?.as_str()? == "luneburg" {
        let center: [f64; 3] = serde_json::from_value(read("center")?).ok()?;
        let radius = number("radius")?;
        (Shape::sphere(center, radius), Index::Luneburg { center: center.into(), radius })
    } else {
        (serde_json::from_value(entry.clone()).ok()?, Index::Constant { ior: number("ior")? })
    };
    let visible = match read("visible") {
        Some(v) => Some(serde_json::from_value(v).ok()?),
        None => None,
    };
    let medium = Medium { index, absorption: [0.0; 3] };
    Some(Body { name: String::new(), shape, matter: Matter::Refractive { medium, priority, visible } })
}

/// The entries of `refractive`. Each states its body twice: for people and for tools that know spheres and boxes
/// (`shape`, its numbers, `ior`), and exactly (`region`, `index`).
pub(super) fn refractive_json(scene: &Scene) -> Value {
    scene.bodies.iter().enumerate().filter_map(|(i, b)| entry_of(scene, i, b)).collect()
}

fn entry_of(scene: &Scene, at: usize, body: &Body) -> Option<Value> {
    let Matter::Refractive { medium, priority, visible } = &body.matter else { return None };
    let region = json!(body.shape);
    let index = json!(medium.index);
    let mut entry = Map::new();
    entry.insert("name".into(), json!(body.name));
    if let Index::Constant { ior } = medium.index {
        // A mesh is written once, under `region`.
        let stated = matches!(body.shape, Shape::Mesh(_))
            .then(|| json!({ "shape": "mesh" }))
            .unwrap_or(region.clone());
        entry.extend(stated.as_object().cloned().unwrap_or_default());
        entry.insert("ior".into(), json!(ior));
    } else {
        entry.extend(index.as_object().cloned().unwrap_or_default());
        if let Some(kind) = entry.remove("kind") {
            entry.insert("shape".into(), kind);
        }
        entry.insert("n".into(), json!(medium.index.formula()));
    }
    entry.insert("outside_ior".into(), json!(outside_of(scene, at, *priority)));
    entry.insert("priority".into(), json!(priority));
    entry.insert("absorption".into(), json!(medium.absorption));
    entry.insert("region".into(), region);
    entry.insert("index".into(), index);
    if let Some(v) = visible {
        entry.insert("visible".into(), json!(v));
    }
    Some(Value::Object(entry))
}

/// The index around a body: that of the medium of lower priority around its centre, else air.
fn outside_of(scene: &Scene, at: usize, priority: u32) -> f64 {
    let center = scene.bodies[at].shape.bounds().center();
    let around = scene.bodies.iter().filter_map(|b| match &b.matter {
        Matter::Refractive { medium, priority: p, .. } if *p < priority && b.shape.contains(center) => {
            Some((*p, medium.index.n(center)))
        }
        _ => None,
    });
    around.max_by_key(|&(p, _)| p).map_or(1.0, |(_, n)| n)
}

/// The shapes of opaque bodies.
pub(super) fn opaque_json(scene: &Scene) -> Value {
    let opaque = |b: &Body| {
        let mut entry = json!(b.shape);
        entry["name"] = json!(b.name);
        if let Matter::Glazed(_, ior) = b.matter {
            entry["glaze_ior"] = json!(ior);
        }
        entry
    };
    scene.bodies.iter().filter(|b| b.medium().is_none()).map(opaque).collect()
}

#[cfg(test)]
mod tests {
    use super::super::scenes::{SceneOptions, scene, scene_list};
    use super::*;
    use refraxel_core::vec3;

    #[test]
    fn a_file_may_hold_the_infinities_that_python_writes() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.json");
        let lens = r#"{"shape": "luneburg", "center": [0, 0, 0], "radius": 0.5}"#;
        std::fs::write(&file, format!(r#"{{"psnr": Infinity, "refractive": [{lens}]}}"#)).unwrap();
        let truth = IndexTruth::read(&file).unwrap().unwrap();
        assert!((truth.n(vec3(0.0, 0.0, 0.0)) - 2.0_f64.sqrt()).abs() < 1e-12);
        std::fs::write(&file, "{}").unwrap();
        assert!(IndexTruth::read(&file).unwrap().is_none());
        assert!(IndexTruth::read(&folder.path().join("none.json")).is_err());
    }

    #[test]
    fn truth_read_from_json_is_the_index_that_was_traced() {
        for info in scene_list() {
            let scene = scene(info.name, &SceneOptions::default()).unwrap();
            let json = json!({ "refractive": refractive_json(&scene), "opaque": opaque_json(&scene) });
            let Some(truth) = IndexTruth::from_scene_json(&json) else {
                assert!(["opaque", "glazed_vase"].contains(&info.name));
                continue;
            };
            let mut inside = 0;
            for k in 0..400_u32 {
                let t = f64::from(k);
                let x = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 2.37).sin()) * 0.6;
                assert!((truth.n(x) - scene.index_at(x)).abs() < 1e-15, "{} {x:?}", info.name);
                inside += u32::from(truth.is_inside(x));
                assert!(!truth.is_inside(x) || (truth.n(x) - 1.0).abs() > 1e-3, "{} {x:?}", info.name);
            }
            assert!(inside > 1, "{}: {inside}", info.name);
        }
    }

    #[test]
    fn the_forms_of_the_path_traced_scenes_are_understood() {
        let json = json!({ "refractive": [
            { "shape": "sphere", "center": [0.03, -0.04, -0.14], "radius": 0.5, "ior": 1.5, "outside_ior": 1.0 }
        ]});
        let ball = IndexTruth::from_scene_json(&json).unwrap();
        assert_eq!((ball.n(vec3(0.0, 0.0, 0.0)), ball.n(vec3(0.0, 0.0, 0.5))), (1.5, 1.0));
        assert!((ball.signed_distance_like(vec3(0.03, -0.04, 0.86)) - 0.5).abs() < 1e-12);
        assert!((ball.bounding_box().max - vec3(0.53, 0.46, 0.36)).length() < 1e-12);
        let json = json!({ "refractive": [
            { "shape": "box", "min": [-0.6, -0.6, -0.78], "max": [0.6, 0.6, 0.0], "ior": 1.33, "note": "water" }
        ]});
        assert_eq!(IndexTruth::from_scene_json(&json).unwrap().n(vec3(0.5, 0.5, -0.1)), 1.33);
        let json = json!({ "refractive": [
            { "shape": "luneburg", "center": [0.0, 0.0, 0.0], "radius": 0.5, "n": "sqrt(2 - r^2/R^2)" }
        ]});
        assert_eq!(IndexTruth::from_scene_json(&json).unwrap().n(Vec3::zero()), 2f64.sqrt());
        assert!(IndexTruth::from_scene_json(&json!({ "refractive": [] })).is_none());
        assert!(IndexTruth::from_scene_json(&json!({ "refractive": [{ "shape": "fog" }] })).is_none());
        assert!(IndexTruth::from_scene_json(&json!({ "name": "x" })).is_none());
    }

    #[test]
    fn the_last_of_the_constant_bodies_around_a_point_has_the_index_there() {
        for info in scene_list() {
            let Some(truth) = IndexTruth::of_scene(&scene(info.name, &SceneOptions::default()).unwrap())
            else {
                continue;
            };
            let Some(bodies) = truth.constant_bodies() else {
                assert!(["luneburg", "fish_eye", "gaussian_bump", "sugar_water"].contains(&info.name));
                continue;
            };
            for k in 0..400_u32 {
                let t = f64::from(k);
                let x = vec3((t * 0.71).sin(), (t * 1.3).cos(), (t * 2.37).sin()) * 0.6;
                let ruling = bodies.iter().rfind(|b| b.shape.contains(x));
                assert_eq!(ruling.map_or(1.0, |b| b.index), truth.n(x), "{} {x:?}", info.name);
            }
        }
    }

    #[test]
    fn a_bubble_of_air_is_outside_and_has_its_own_border() {
        let hollow = IndexTruth::of_scene(&scene("hollow_ball", &SceneOptions::default()).unwrap()).unwrap();
        let at = |r: f64| vec3(0.02, -0.03, -0.13 + r);
        assert!(!hollow.is_inside(at(0.3)) && hollow.is_inside(at(0.45)) && !hollow.is_inside(at(0.52)));
        assert!((hollow.signed_distance_like(at(0.3)) - 0.1).abs() < 1e-12);
        assert!(hollow.is_opaque(at(0.0)) && !hollow.is_opaque(at(0.45)));
    }
}
