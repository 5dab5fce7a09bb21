//! The scenes, named for what they show.

mod graded;
mod rooms;
mod sharp;
mod surroundings;
mod water;

pub use rooms::{Room, room, room_list};

use super::error::SynthError;
use super::scene::Scene;
use super::shape::TriangleMesh;
use surroundings::Setting;

/// What `refraxel synth --list` prints about a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneInfo {
    /// Name on the command line.
    pub name: &'static str,
    /// What it shows, in one sentence.
    pub shows: &'static str,
    /// The index that may be chosen: what it belongs to, its default and its range. `None`: fixed by a formula.
    pub ior: Option<IorRange>,
}

/// The index of a scene that may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IorRange {
    /// Used when no other is given.
    pub default: f64,
    /// Smallest allowed.
    pub min: f64,
    /// Largest allowed.
    pub max: f64,
}

/// Options of a scene.
#[derive(Clone, Debug, Default)]
pub struct SceneOptions {
    /// Choice of textures and of the turn of the surroundings; 0 is the usual picture.
    pub seed: u64,
    /// Index of the main refractive body instead of the default.
    pub ior: Option<f64>,
    /// Shape of the body in `glass_mesh` instead of the knot; fitted to the place of the ball.
    pub mesh: Option<TriangleMesh>,
}

type Build = fn(&Setting) -> Scene;

/// A line of a list of scenes: what it shows, and what makes it.
type Entry<T> = (SceneInfo, T);

const GLASS: Option<IorRange> = Some(IorRange { default: 1.5, min: 1.0, max: 4.0 });
const WATER: Option<IorRange> = Some(IorRange { default: 1.33, min: 1.0, max: 4.0 });

const fn info(name: &'static str, shows: &'static str, ior: Option<IorRange>) -> SceneInfo {
    SceneInfo { name, shows, ior }
}

const SCENES: [Entry<Build>; 23] = [
    (info("opaque", "nothing refracts: the control for straight rays", None), sharp::opaque),
    (
        info("glazed_vase", "nothing refracts: a dark opaque vase under a clearcoat that mirrors", GLASS),
        sharp::glazed_vase,
    ),
    (
        info("glass_ball", "a solid ball of glass turns its surroundings upside down", GLASS),
        sharp::glass_ball,
    ),
    (info("hidden_ball", "a glass ball half hidden by opaque columns and a slab", GLASS), sharp::hidden_ball),
    (
        info("glass_blob", "a non-convex blob of glass: rays enter and leave it twice", GLASS),
        sharp::glass_blob,
    ),
    (info("wine_glass", "a thick wine glass: thin curved walls and a stem", GLASS), sharp::wine_glass),
    (
        info("water_tank", "a block of water with things in it, on the ground and reaching out", WATER),
        water::water_tank,
    ),
    (
        info("aquarium", "water between walls of glass, with things in it: nested media", WATER),
        water::aquarium,
    ),
    (
        info(
            "drinking_glass",
            "a glass of water with a straw and a ball in it: thin walls, nested media",
            GLASS,
        ),
        water::drinking_glass,
    ),
    (
        info("wavy_pool", "a basin of water under waves, with things on its floor, seen from above", WATER),
        water::wavy_pool,
    ),
    (
        info(
            "diamond",
            "a brilliant cut: flat facets and total internal reflection",
            Some(IorRange { default: 2.42, min: 1.0, max: 4.0 }),
        ),
        sharp::diamond,
    ),
    (
        info(
            "faceted",
            "a stone with twenty irregular flat faces",
            Some(IorRange { default: 1.7, min: 1.0, max: 4.0 }),
        ),
        sharp::faceted,
    ),
    (
        info("prism", "a right-angled prism of glass mirrors by total internal reflection", GLASS),
        sharp::prism,
    ),
    (info("hollow_ball", "a hollow glass ball with a textured cube in its air", GLASS), sharp::hollow_ball),
    (info("bubble", "bubbles of air in a block of glass, whose faces mirror", GLASS), sharp::bubble),
    (
        info(
            "two_indices",
            "two bodies of different index: a ball of the chosen one and a capsule of 1.33",
            Some(IorRange { default: 1.7, min: 1.0, max: 4.0 }),
        ),
        sharp::two_indices,
    ),
    (
        info("pair", "a glass ball and an upright slab of 1.33, one seen through the other", GLASS),
        sharp::pair,
    ),
    (info("tinted_glass", "a ring of amber glass around a ball of teal glass", GLASS), sharp::tinted_glass),
    (
        info("glass_mesh", "a knotted tube of glass as a triangle mesh, or an imported mesh", GLASS),
        sharp::glass_mesh,
    ),
    (
        info("luneburg", "a Luneburg lens: the index falls from 1.41 to 1 without a step", None),
        graded::luneburg,
    ),
    (
        info("fish_eye", "Maxwell's fish-eye: the index falls from 2 to 1 without a step", None),
        graded::fish_eye,
    ),
    (
        info(
            "gaussian_bump",
            "a bump of the index without any border; below 1 it is hot air",
            Some(IorRange { default: 1.35, min: 0.7, max: 2.0 }),
        ),
        graded::gaussian_bump,
    ),
    (
        info("sugar_water", "a tank of sugar water whose index falls with height: rays are parabolas", None),
        graded::sugar_water,
    ),
];

/// All scenes, in the order of `--list`.
pub fn scene_list() -> Vec<SceneInfo> {
    SCENES.iter().map(|(info, _)| *info).collect()
}

/// Builds a scene by name.
///
/// # Errors
/// [`SynthError::UnknownScene`], and [`SynthError::Range`] for an index that the scene forbids.
pub fn scene(name: &str, options: &SceneOptions) -> Result<Scene, SynthError> {
    let (info, build, ior) = chosen(&SCENES, name, options.ior)?;
    let mut scene = build(&Setting::new(options.seed, ior, options.mesh.clone()));
    scene.name = info.name.into();
    scene.shows = info.shows.into();
    Ok(scene)
}

/// The line of a name in a list, with the index of its main body.
fn chosen<T: Copy>(
    list: &[Entry<T>],
    name: &str,
    ior: Option<f64>,
) -> Result<(SceneInfo, T, f64), SynthError> {
    let Some(&(info, made_by)) = list.iter().find(|(info, _)| info.name == name) else {
        let known = list.iter().map(|(info, _)| info.name).collect::<Vec<_>>().join(", ");
        return Err(SynthError::UnknownScene { found: name.into(), known });
    };
    let range = |expected: String| {
        let found = ior.map_or(String::new(), |n| n.to_string());
        Err(SynthError::Range { option: "--ior", found, expected })
    };
    let ior = match (info.ior, ior) {
        (None, Some(_)) => return range(format!("nothing: the scene {name} has no index to choose")),
        (Some(r), Some(n)) if !(n >= r.min && n <= r.max) => {
            return range(format!("a number from {} to {} for the scene {name}", r.min, r.max));
        }
        (r, n) => n.or(r.map(|r| r.default)).unwrap_or(1.0),
    };
    Ok((info, made_by, ior))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_scene_builds_and_its_bodies_lie_in_its_box() {
        for info in scene_list() {
            for seed in [0, 7] {
                let scene = scene(info.name, &SceneOptions { seed, ..SceneOptions::default() }).unwrap();
                assert!(scene.bodies.len() <= 64);
                for body in &scene.bodies {
                    let b = body.visible_shape().bounds();
                    let e = scene.bounds;
                    let (low, high) = ((b.min - e.min).min_element(), (e.max - b.max).min_element());
                    assert!(low > -0.06 && high > -0.06, "{}: {} {b:?}", info.name, body.name);
                }
            }
        }
    }

    #[test]
    fn an_unknown_scene_is_answered_with_the_known_ones() {
        let message = scene("glas_ball", &SceneOptions::default()).unwrap_err().to_string();
        assert!(
            message.contains("\"glas_ball\"") && message.contains("glass_ball, hidden_ball"),
            "{message}"
        );
    }

    #[test]
    fn an_index_below_one_is_refused_where_the_scene_forbids_it() {
        let with = |ior| SceneOptions { ior: Some(ior), ..SceneOptions::default() };
        assert!(scene("glass_ball", &with(0.9)).unwrap_err().to_string().contains("from 1 to 4"));
        assert!(scene("glass_ball", &with(f64::NAN)).is_err());
        assert!(scene("luneburg", &with(1.5)).unwrap_err().to_string().contains("no index to choose"));
        assert!(scene("gaussian_bump", &with(0.9)).is_ok());
    }
}
