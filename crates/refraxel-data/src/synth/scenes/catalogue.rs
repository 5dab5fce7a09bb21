//! The list of all scenes, and the scene of a name.

use super::choice::{Entry, GLASS, IorRange, STONE, SceneInfo, SceneOptions, WATER, chosen, info, matter};
use super::surroundings::Setting;
use super::{graded, sharp, water};
use crate::synth::error::SynthError;
use crate::synth::scene::Scene;

type Build = fn(&Setting) -> Scene;

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
        info("diamond", "a brilliant cut: flat facets and total internal reflection", matter(2.42)),
        sharp::diamond,
    ),
    (info("faceted", "a stone with twenty irregular flat faces", STONE), sharp::faceted),
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
            STONE,
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
