//! The list of all rooms, and the room of a name.

use super::decor::Decor;
use super::place::Place;
use super::things;
use crate::synth::cameras::Viewpoints;
use crate::synth::elevations::Elevations;
use crate::synth::error::SynthError;
use crate::synth::scene::{Body, Scene};
use crate::synth::scenes::choice::{Entry, GLASS, STONE, SceneInfo, SceneOptions, WATER, chosen, info};
use crate::synth::scenes::surroundings::Setting;
use refraxel_core::vec3;

/// A scene for photographs, and where they are taken from.
#[derive(Clone, Debug)]
pub struct Room {
    /// The room and the thing in it.
    pub scene: Scene,
    /// Where the photographer stands.
    pub viewpoints: Viewpoints,
}

/// The things on the table, and the elevations from which they are photographed.
#[derive(Clone, Copy)]
struct Subject {
    place: Place,
    things: fn(&Setting, &Decor) -> Vec<Body>,
    elevations: Elevations,
}

const fn degrees(low: f64, high: f64) -> Elevations {
    const DEGREE: f64 = std::f64::consts::PI / 180.0;
    Elevations { low: low * DEGREE, high: high * DEGREE }
}

const AROUND: Elevations = degrees(6.0, 42.0);

const fn subject(place: Place, things: fn(&Setting, &Decor) -> Vec<Body>) -> Subject {
    Subject { place, things, elevations: AROUND }
}

const ROOMS: [Entry<Subject>; 11] = [
    (
        info("kitchen_bear", "a solid bear of glass on a kitchen table", GLASS),
        subject(Place::Kitchen, things::bear),
    ),
    (
        info("kitchen_vessel", "a tall thin-walled vessel, two thirds full of water", GLASS),
        subject(Place::Kitchen, things::vessel),
    ),
    (
        info("kitchen_marbles", "five marbles of glass in a pile, each touching three or four", GLASS),
        subject(Place::Kitchen, things::marbles),
    ),
    (
        info("study_crystal", "a crystal of twenty irregular flat faces on a desk", STONE),
        subject(Place::Study, things::stone),
    ),
    (
        info("study_bottle", "a closed, empty bottle: glass around air", GLASS),
        subject(Place::Study, things::bottle),
    ),
    (
        info("study_hidden", "a ball of glass behind a cup, books and a pencil", GLASS),
        subject(Place::Study, things::hidden),
    ),
    (
        info("terrace_ball", "a solid ball of glass in a garden, far things around", GLASS),
        subject(Place::Terrace, things::ball),
    ),
    (
        info("terrace_pair", "a ball of glass that touches a hexagonal crystal", GLASS),
        subject(Place::Terrace, things::pair),
    ),
    (
        info("terrace_basin", "water under waves in a basin, seen from above", WATER),
        Subject { elevations: degrees(34.0, 72.0), ..subject(Place::Terrace, things::basin) },
    ),
    (
        info("study_mirrors", "nothing refracts: a mirror ball, metal and a glazed vase", None),
        subject(Place::Study, things::mirrors),
    ),
    (
        info("kitchen_opaque", "nothing refracts: fruit, a jug and boxes", None),
        subject(Place::Kitchen, things::opaque),
    ),
];

/// All rooms, in the order of `--list`.
pub fn room_list() -> Vec<SceneInfo> {
    ROOMS.iter().map(|(info, _)| *info).collect()
}

/// Builds a room by name.
///
/// # Errors
/// Those of [`scene`](crate::synth::scene()).
pub fn room(name: &str, options: &SceneOptions) -> Result<Room, SynthError> {
    let (info, subject, ior) = chosen(&ROOMS, name, options.ior)?;
    let setting = Setting::new(options.seed, ior, None);
    let (decor, arc) = subject.place.decor(&setting);
    let mut bodies = subject.place.bodies(&decor);
    bodies.extend((subject.things)(&setting, &decor));
    let scene = Scene {
        name: info.name.into(),
        shows: info.shows.into(),
        bodies,
        environment: subject.place.environment(&setting),
        bounds: Scene::usual_bounds(),
        elevations: subject.elevations,
    };
    let viewpoints = Viewpoints {
        elevations: subject.elevations,
        azimuths: arc.map(f64::to_radians),
        distances: [2.3, 2.9],
        target: vec3(0.0, 0.0, -0.3),
        angle_x: 56_f64.to_radians(),
    };
    Ok(Room { scene, viewpoints })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::synth::scene::Matter;

    fn all(seed: u64) -> impl Iterator<Item = Room> {
        let options = SceneOptions { seed, ..SceneOptions::default() };
        room_list().into_iter().map(move |info| room(info.name, &options).unwrap())
    }

    #[test]
    fn every_room_has_one_thing_to_reconstruct_in_its_box_and_walls_far_outside() {
        for room in all(0).chain(all(7)) {
            let (scene, e) = (&room.scene, room.scene.bounds);
            assert!(scene.bodies.len() <= 64, "{}: {}", scene.name, scene.bodies.len());
            for body in scene.bodies.iter().filter(|b| b.medium().is_some()) {
                let b = body.shape.bounds();
                assert!((b.min - e.min).min_element() > -0.06 && (e.max - b.max).min_element() > -0.06);
            }
            let far = |b: &Body| b.shape.bounds().max.max_element() > 4.0 * e.max.max_element();
            assert!(scene.bodies.iter().filter(|b| far(b)).count() >= 3, "{}", scene.name);
        }
    }

    #[test]
    fn photographers_stand_in_the_open_and_see_the_box() {
        for room in all(0) {
            for camera in room.viewpoints.cameras(60, 3, [48, 36]) {
                let eye = camera.world_from_camera.translation;
                assert!(room.scene.bodies.iter().all(|b| b.medium().is_some() || !b.shape.contains(eye)));
                let seen = camera.project(room.scene.bounds.center()).unwrap();
                assert!((0.0..48.0).contains(&seen[0]) && (0.0..36.0).contains(&seen[1]), "{seen:?}");
            }
        }
    }

    #[test]
    fn two_rooms_refract_nothing_and_nine_do() {
        let refracts = |room: &Room| room.scene.bodies.iter().any(|b| b.medium().is_some());
        assert_eq!(all(0).filter(refracts).count(), 9);
        let mirrors = room("study_mirrors", &SceneOptions::default()).unwrap();
        assert!(mirrors.scene.bodies.iter().any(|b| matches!(b.matter, Matter::Glazed(..))));
    }

    #[test]
    fn bodies_that_touch_leave_no_gap_and_share_no_space() {
        let scene = room("terrace_pair", &SceneOptions::default()).unwrap().scene;
        let shapes: Vec<_> = scene.bodies.iter().filter(|b| b.medium().is_some()).map(|b| &b.shape).collect();
        let bounds = shapes[0].bounds();
        let (center, radius) = (bounds.center(), 0.5 * bounds.extent().x);
        assert!((shapes[1].surface(center).0 - radius).abs() < 1e-9);
    }
}
