//! What happens in a run, in words.

use refraxel_train::events::{Event, FoundIndex, Task};
use refraxel_train::initial::Profile;
use refraxel_train::schedule::Phase;

/// An event in a sentence; none for what progress bars show.
pub fn sentence(event: &Event) -> Option<String> {
    Some(match event {
        Event::Stage { stage, resolution: [x, y, z], voxels } => {
            format!("stage {}: grid of {x} x {y} x {z} nodes, {voxels} voxels stored", stage + 1)
        }
        Event::RegionFound { region, center, extent, nodes, faces } => {
            let [[ex, ey, ez], [cx, cy, cz], n] = [*extent, *center, nodes.map(|n| n as f32)];
            let faces = faces.map_or(String::new(), |n| format!(", bounded by {n} flat faces"));
            format!(
                "refractive region {}: {ex:.3} x {ey:.3} x {ez:.3} around ({cx:.3}, {cy:.3}, {cz:.3}), \
                 {} x {} x {} nodes{faces}",
                region + 1,
                n[0],
                n[1],
                n[2]
            )
        }
        Event::IndexSearched { profile, regions, misfit } => {
            let indices: Vec<String> = regions.iter().map(found).collect();
            let place = profile_name(*profile);
            format!("{place}: index {} fits best, misfit {misfit:.3}", indices.join(", "))
        }
        Event::IndexGuessed { straight_misfit, index } => {
            format!("straight rays fit as well (misfit {straight_misfit:.3}): starting from index {index}")
        }
        Event::RaysBend { profile } => format!("rays bend {}", profile_name(*profile)),
        Event::RaysStayStraight { why } => format!("rays stay straight: {why}"),
        Event::ClearcoatAdded => "opaque things have a clearcoat that mirrors".to_owned(),
        Event::RolledBack { step, rate_scale } => format!(
            "step {step} overflowed: back to the last good state, with {:.1} % of the learning rates",
            100.0 * rate_scale
        ),
        // Progress bars show the others.
        _ => return None,
    })
}

fn found(f: &FoundIndex) -> String {
    match f.wall {
        1.0 => format!("{:.3}", f.index),
        wall => format!("{:.3} (hollow: the wall is {:.0} % of the depth)", f.index, 100.0 * wall),
    }
}

fn profile_name(profile: Profile) -> &'static str {
    match profile {
        Profile::Sharp => "at a sharp surface",
        Profile::Smooth => "through a smooth transition",
        Profile::Graded => "in an index gradient",
    }
}

/// What a run is busy with.
pub fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Straight => "straight",
        Phase::Index => "index alone",
        Phase::Joint => "all together",
    }
}

/// A piece of work that takes a while.
pub fn task_name(task: Task) -> &'static str {
    match task {
        Task::LoadingPhotos => "images",
        Task::FindingOccluders => "finding occluders",
        Task::Carving => "carving shapes",
        Task::SearchingIndex => "index search",
        Task::Baking => "baking reflections",
        Task::Pruning => "finer grid",
        Task::Evaluating => "rendering",
        _ => "training",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_found_is_said_with_its_figures() {
        let regions = vec![FoundIndex { index: 1.5, wall: 1.0 }, FoundIndex { index: 1.6, wall: 0.25 }];
        let event = Event::IndexSearched { profile: Profile::Sharp, regions, misfit: 0.1234 };
        let expected = "at a sharp surface: index 1.500, 1.600 (hollow: the wall is 25 % of the depth) fits best, \
                        misfit 0.123";
        assert_eq!(sentence(&event).unwrap(), expected);
        assert_eq!(sentence(&Event::Progress { task: Task::Carving, done: 1, total: 3 }), None);
    }
}
