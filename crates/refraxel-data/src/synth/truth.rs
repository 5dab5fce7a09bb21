//! The truth about refractive objects that `scene.json` states: it is written for our scenes, and read for ours and for
//! the path-traced ones.

use super::elevations::Elevations;
use super::entry;
use super::medium::Index;
use super::scene::{Body, Environment, Matter, Scene};
use super::shape::Shape;
use crate::json::{self, Object};
use crate::origin::Placed;
use crate::{DataError, limits};
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
    /// Reads a `scene.json`.
    ///
    /// Errors: those of [`IndexTruth::parse`], or the file cannot be read, is too large, or is not JSON (`NaN` and
    /// `Infinity`, which Python writes, are understood where nothing needs them).
    pub fn read(path: &Path) -> Result<IndexTruth, DataError> {
        Self::parse(path, &json::read(path)?)
    }

    /// Number of refractive things that a `scene.json` lists, whether they can be read or not.
    pub fn listed(json: &Value) -> usize {
        json.get("refractive").and_then(Value::as_array).map_or(0, Vec::len)
    }

    /// Reads the list `refractive` (and `opaque`, where there is one) of the `scene.json` at `path`.
    ///
    /// It understands our own entries (keys `region` and `index`) and those of the path-traced scenes: `shape` sphere
    /// (`center`, `radius`, `ior`), box (`min`, `max`, `ior`) and luneburg (`center`, `radius`). Later entries lie
    /// inside earlier ones.
    ///
    /// Errors: there is no such list, it is empty or has more than 64 bodies, an entry is of another kind, a body has no
    /// size or an index that no matter has, or nothing bends a ray.
    pub fn parse(path: &Path, json: &Value) -> Result<IndexTruth, DataError> {
        let top = Object::new(path, "", json)?;
        let list = |key: &str| top.get(key).and_then(Value::as_array).map_or(&[][..], Vec::as_slice);
        let (refractive, opaque) = (list("refractive"), list("opaque"));
        if refractive.is_empty() {
            return Err(top.wrong("refractive", "a list of one refractive body or more"));
        }
        limits::bodies(path, refractive.len() + opaque.len())?;
        let numbered = refractive.iter().enumerate().map(|(i, e)| entry::refractive(path, i, e));
        let mut bodies = numbered.collect::<Result<Vec<Body>, DataError>>()?;
        let is_air = |b: &Body| b.medium().is_some_and(|m| m.index == Index::Constant { ior: 1.0 });
        if bodies.iter().all(is_air) {
            let (path, key, found) =
                (path.to_owned(), "refractive".to_owned(), "of index 1 in all bodies".to_owned());
            return Err(DataError::Value { path, key, found, expected: "one body or more that bends rays" });
        }
        for (i, e) in opaque.iter().enumerate() {
            bodies.push(entry::opaque(path, i, e)?);
        }
        Ok(IndexTruth::from_bodies(bodies))
    }

    /// The truth that comes with a dataset; `None` where [`IndexTruth::parse`] refuses it.
    pub fn from_scene_json(json: &Value) -> Option<IndexTruth> {
        Self::parse(Path::new("scene.json"), json).ok()
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

    /// The refractive index at a position; 1 in air, and undefined (that of its surroundings) in opaque bodies.
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

    /// The box of each refractive body.
    pub fn boxes(&self) -> impl Iterator<Item = Aabb<f64>> {
        self.media().map(|(_, body, _)| body.shape.bounds())
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

impl Placed for IndexTruth {
    fn moved(mut self, by: Vec3<f64>) -> Self {
        self.scene.bodies = self.scene.bodies.into_iter().map(|body| body.moved(by)).collect();
        self
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
        let truth = IndexTruth::read(&file).unwrap();
        assert!((truth.n(vec3(0.0, 0.0, 0.0)) - 2.0_f64.sqrt()).abs() < 1e-12);
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

    /// Why a `scene.json` with this list of refractive bodies is refused.
    fn refusal(refractive: Value) -> String {
        let json = json!({ "refractive": refractive });
        IndexTruth::parse(Path::new("scene.json"), &json).unwrap_err().to_string()
    }

    #[test]
    fn an_entry_that_makes_no_sense_is_refused_by_its_field() {
        let ball = |key: &str, value: Value| {
            let mut entry = json!({ "shape": "sphere", "center": [0, 0, 0], "radius": 0.5, "ior": 1.5 });
            entry[key] = value;
            entry
        };
        let tube = |axis: [f64; 3]| {
            let ring =
                json!({ "part": "torus", "center": [0, 0, 0], "axis": axis, "major": 0.3, "minor": 0.1 });
            json!({ "region": { "shape": "implicit", "parts": [ring], "blend": 0.0 },
                    "index": { "kind": "constant", "ior": 1.5 } })
        };
        let fibre = json!({ "region": { "shape": "sphere", "center": [0, 0, 0], "radius": 0.5 },
            "index": { "kind": "fibre", "center": [0, 0, 0], "axis": [0, 0, 1], "ior": 1.5, "alpha": 9.0 } });
        let cases = [
            (ball("radius", json!(0)), "refractive[1].radius is 0; expected a finite number > 0"),
            (ball("radius", Value::Null), "refractive[1].radius is null (or NaN)"),
            (ball("center", json!([0, 0])), "refractive[1] is invalid length 2"),
            (
                ball("center", json!([0, "a", 0])),
                "refractive[1].center is [0,\"a\",0]; expected finite numbers",
            ),
            (ball("center", json!([1e300, 0, 0])), "refractive[1] is a body from [1e300, -0.5, -0.5]"),
            (ball("ior", json!("glass")), "refractive[1].ior is \"glass\""),
            (
                ball("ior", json!(1e30)),
                "refractive[1].ior is 1000000000000000000000000000000; expected an index",
            ),
            (ball("ior", json!(0)), "refractive[1].ior is 0; expected an index"),
            (ball("shape", json!("teapot")), "refractive[1] is unknown variant `teapot`"),
            (
                tube([0.0, 0.0, 2.0]),
                "refractive[1].region.parts[0].axis is [0.0,0.0,2.0]; expected a vector of length 1",
            ),
            (fibre, "refractive[1].index is NaN; expected an index"),
        ];
        for (entry, expected) in cases {
            let message = refusal(json!([ball("ior", json!(1.5)), entry]));
            assert!(message.contains("scene.json: ") && message.contains(expected), "{message}");
        }
    }

    #[test]
    fn too_many_bodies_and_bodies_of_air_alone_are_refused() {
        let ball = |ior: f64| json!({ "shape": "sphere", "center": [0, 0, 0], "radius": 0.5, "ior": ior });
        assert!(refusal(json!([ball(1.0)])).contains("refractive is of index 1 in all bodies"));
        let bubble = json!({ "refractive": [ball(1.5), ball(1.0)] });
        assert!(IndexTruth::from_scene_json(&bubble).is_some(), "a bubble in glass is welcome");
        let many = refusal(vec![ball(1.5); 10_000].into());
        assert!(many.contains("the number of bodies is 10000, the limit is 64"), "{many}");
        let wave = json!({ "amplitude": 0.0, "vector": [1, 0], "phase": 0 });
        let sea = json!({ "shape": "height_field", "min": [0, 0, 0], "max": [1, 1], "level": 1, "waves": vec![wave; 999] });
        let sea = refusal(json!([{ "region": sea, "index": { "kind": "constant", "ior": 1.33 } }]));
        assert!(sea.contains("is 999, the limit is 128"), "{sea}");
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
