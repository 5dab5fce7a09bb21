//! What happens in a run, in words.

use crate::table::decimals;
use refraxel_train::device::Device;
use refraxel_train::events::{Event, IgnoredMask, Task};
use refraxel_train::schedule::Phase;
use refraxel_train::verdict::{Contestant, Difference, Evidence, Found, Proof, RegionVerdict, Verdict};

/// An event in a sentence; none for what progress bars show.
pub fn sentence(event: &Event) -> Option<String> {
    Some(match event {
        Event::Stage { stage, resolution: [x, y, z], voxels } => {
            format!("stage {}: grid of {x} x {y} x {z} nodes, {voxels} voxels stored", stage + 1)
        }
        Event::RegionFound { region, center, extent, nodes, faces, ellipsoid, revolution } => {
            let ([ex, ey, ez], [cx, cy, cz], n) = (*extent, *center, *nodes);
            let shape = match (faces, ellipsoid) {
                (_, Some(misfit)) => format!(", an ellipsoid to {misfit:.2} pixels"),
                _ if *revolution => ", round about an upright axis".to_owned(),
                (Some(n), _) => format!(", bounded by {n} flat faces"),
                _ => String::new(),
            };
            let d = decimals(ex.max(ey).max(ez).into(), 3);
            format!(
                "refractive region {}: {ex:.d$} x {ey:.d$} x {ez:.d$} around ({cx:.d$}, {cy:.d$}, {cz:.d$}), \
                 {} x {} x {} nodes{shape}",
                region + 1,
                n[0],
                n[1],
                n[2]
            )
        }
        Event::MasksCompleted { stated, views, is_completed: true, pixels, .. } => format!(
            "{stated} of {views} training views have masks: their visual hull completes the masks of the other views \
             ({:.1} % of the pixels in all)",
            100.0 * pixels
        ),
        Event::MasksCompleted { stated, views, needed, .. } => format!(
            "{stated} of {views} training views have masks, which {}: the other views are used as if they showed nothing \
             refractive; `refraxel mask DATA` makes the missing masks",
            if stated < needed {
                format!("is too few ({needed} are needed)")
            } else {
                "agree nowhere".to_owned()
            }
        ),
        Event::MasksShifted { by, inside, outside } => format!(
            "masks are too {} by {:.1} pixels: straight rays begin to fail that far {} their borders (misfit {inside:.2} inside of there, \
             {outside:.2} outside); the borders are moved",
            if *by > 0.0 { "narrow" } else { "wide" },
            by.abs(),
            if *by > 0.0 { "beyond" } else { "within" },
        ),
        Event::Outlined { before, now, pixels } => format!(
            "the outlines of the regions were drawn anew where straight rays begin to fail: they explain {:.0} % of the misfit beside \
             them instead of {:.0} % ({:.1} % of the pixels lie inside)",
            100.0 * now,
            100.0 * before,
            100.0 * pixels
        ),
        Event::NothingDetected { separation, needed } => format!(
            "no masks: straight rays explain the photographs (separation {separation:.3}, needed {needed})"
        ),
        Event::Detected { separation, pixels } => format!(
            "no masks: straight rays cannot explain {:.1} % of the pixels (separation {separation:.2})",
            100.0 * pixels
        ),
        Event::MasksIgnored { views, usual_overlap } => ignored(views, *usual_overlap),
        Event::IndexSearched { region, hypothesis, found, likeness } => {
            format!(
                "region {}: {}, {}, likeness {likeness:.2}",
                region + 1,
                hypothesis.name(),
                numbers(found)
            )
        }
        Event::IndexGuessed { region, index } => {
            format!(
                "region {}: the prediction leaves its content open; the index {index} is a guess",
                region + 1
            )
        }
        Event::Judged { verdict, .. } => verdict_text(verdict),
        Event::RaysBend { hypotheses } => {
            let names: Vec<_> = hypotheses.iter().map(|h| h.name()).collect();
            format!("rays bend: {}", names.join(", "))
        }
        Event::Proven { proof } => proof_text(proof),
        Event::RaysStayStraight { why } => format!("rays stay straight: {why}"),
        Event::DeviceChosen { device: Device { name, why: Some(why) } } => {
            format!("trained on {name}, since {why}")
        }
        Event::DeviceChosen { device } => format!("trained on {}", device.name),
        Event::DrawnOnHost { why } => format!("batches are drawn on the host: {why}"),
        Event::ClearcoatAdded => "opaque things have a clearcoat that mirrors".to_owned(),
        Event::RolledBack { step, rate_scale } => format!(
            "step {step} overflowed: back to the last good state, with {:.1} % of the learning rates",
            100.0 * rate_scale
        ),
        // Progress bars show the others.
        _ => return None,
    })
}

/// Numbers that a search found.
fn numbers(found: &[Found]) -> String {
    let number = |f: &Found| match f.name.as_str() {
        "wall" => format!("wall {:.0} % of the depth", 100.0 * f.value),
        "filling" => format!("filled with index {:.2}", f.value),
        "water" => format!("water up to {:.0} % of the height", 100.0 * f.value),
        "level" => format!("level at {:.0} % of the height that the masks allow", 100.0 * f.value),
        "offset" => format!("offset {:.1} voxels", f.value),
        name => format!("{name} {:.3}", f.value),
    };
    found.iter().map(number).collect::<Vec<_>>().join(", ")
}

/// Names of views in one sentence, at most.
const NAMED: usize = 8;

fn ignored(views: &[IgnoredMask], usual_overlap: f32) -> String {
    let name = |v: &IgnoredMask| format!("{} ({:.0} %)", v.view, 100.0 * v.overlap);
    let mut names: Vec<String> = views.iter().take(NAMED).map(name).collect();
    if views.len() > NAMED {
        names.push(format!("{} more", views.len() - NAMED));
    }
    format!(
        "masks that contradict the others are left out of the shape: {}; the percentage is their overlap with the hull \
         of the other views, {:.0} % is usual; check whether they are missing or belong to another view",
        names.join(", "),
        100.0 * usual_overlap
    )
}

/// What the judge decided, one line per region.
pub fn verdict_text(verdict: &Verdict) -> String {
    let region = |r: &RegionVerdict| {
        let raced = !r.contestants.is_empty();
        // It is of what was predicted, which need not have won a race.
        let range = r.evidence.and_then(|e| e.index).filter(|_| !r.found.is_empty() && !raced);
        // What won a race may have begun with numbers that were only assumed.
        let begins = if raced { "beginning with " } else { "" };
        let numbers = Some(numbers(&r.found)).filter(|n| !n.is_empty());
        let found = [numbers.map(|n| format!("{begins}{n}")), range.map(interval)];
        let what: Vec<String> =
            [r.hypothesis.name().to_owned()].into_iter().chain(found.into_iter().flatten()).collect();
        let why = [raced.then(|| race_text(r, verdict.views)), r.evidence.map(evidence_text)];
        let why: Vec<String> = why.into_iter().flatten().collect();
        let why = if why.is_empty() { String::new() } else { format!(" ({})", why.join("; ")) };
        format!("region {}: {}{why}", r.region + 1, what.join(", "))
    };
    let regions = verdict.regions.iter().map(region);
    regions.chain(verdict.proof.as_ref().map(proof_text)).collect::<Vec<_>>().join("\n")
}

/// How a race ended.
fn race_text(region: &RegionVerdict, views: usize) -> String {
    let one = |c: &Contestant| {
        let number = |name: &str| c.found.iter().find(|f| f.name == name);
        let index = number("filling")
            .or(number("index"))
            .map_or(String::new(), |f| format!(" of index {:.2}", f.value));
        format!("{}{index}: {:.2} dB", c.hypothesis.name(), c.inside)
    };
    format!(
        "bent rays {:+.2} ± {:.2} dB inside, {:+.2} dB outside, on {views} views kept aside; {}",
        region.gain_inside,
        region.error,
        region.gain_outside,
        region.contestants.iter().map(one).collect::<Vec<_>>().join(", ")
    )
}

/// How bent rays stood against straight ones on the way.
fn proof_text(proof: &Proof) -> String {
    let gain = |gain: Option<f64>| gain.map_or("unknown".to_owned(), |g| format!("{g:+.2} dB"));
    format!(
        "after {:.0} % of the run, bent rays against straight rays at the decision, on views kept aside: {} inside, {} outside{}",
        100.0 * proof.progress,
        gain(proof.inside),
        gain(proof.outside),
        if proof.is_failed() { ": rays are straight again" } else { "" }
    )
}

/// An interval of the index wider than this reaches to where its search ends, and says nothing.
const UNDECIDED: f32 = 0.5;

fn interval([low, high]: [f32; 2]) -> String {
    match high - low > UNDECIDED {
        true => "which these photographs do not narrow down".to_owned(),
        false => format!("index {low:.3} to {high:.3}"),
    }
}

/// What a prediction without training says of a region.
fn evidence_text(evidence: Evidence) -> String {
    let of = |d: &Difference| format!("{:.2} ± {:.2}", d.mean, d.error);
    format!(
        "likeness to {} photographs kept aside: predicted {}, straight through {}, straight rays after training {}, other photographs {}",
        evidence.predicted.views,
        of(&evidence.predicted),
        of(&evidence.straight_through),
        of(&evidence.trained_straight),
        of(&evidence.other_photographs),
    )
}

/// What a run is busy with.
pub fn phase_name(phase: Phase) -> &'static str {
    match phase {
        Phase::Straight => "straight",
        Phase::Index => "index alone",
        Phase::Joint => "joint",
    }
}

/// A piece of work that takes a while.
pub fn task_name(task: Task) -> &'static str {
    match task {
        Task::LoadingPhotos => "images",
        Task::Seeking => "looking for glass",
        Task::FindingOccluders => "finding occluders",
        Task::Carving => "carving shapes",
        Task::SearchingIndex => "index search",
        Task::RefiningSurface => "refining the surface",
        Task::Judging => "comparing with straight rays",
        Task::Baking => "baking reflections",
        Task::Pruning => "finer grid",
        Task::Evaluating => "rendering",
        _ => "training",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use refraxel_train::verdict::Hypothesis;

    #[test]
    fn masks_that_are_left_out_are_named() {
        let views = (0..10).map(|k| IgnoredMask { view: format!("r_{k}.png"), overlap: 0.01 * k as f32 });
        let said = sentence(&Event::MasksIgnored { views: views.collect(), usual_overlap: 0.93 }).unwrap();
        assert!(
            said.contains("r_0.png (0 %), r_1.png (1 %)") && said.contains("r_7.png (7 %), 2 more"),
            "{said}"
        );
        assert!(said.contains("93 % is usual"), "{said}");
    }

    #[test]
    fn what_was_found_is_said_with_its_figures() {
        let number = |name: &str, value| Found { name: name.to_owned(), value };
        let found = vec![number("index", 1.6), number("wall", 0.25)];
        let event =
            Event::IndexSearched { region: 0, hypothesis: Hypothesis::Shell, found, likeness: 0.1234 };
        let expected = "region 1: a shell with air in it, index 1.600, wall 25 % of the depth, likeness 0.12";
        assert_eq!(sentence(&event).unwrap(), expected);
        assert_eq!(sentence(&Event::Progress { task: Task::Carving, done: 1, total: 3 }), None);
    }

    #[test]
    fn a_verdict_says_what_raced_and_what_was_predicted() {
        let number = |name: &str, value| Found { name: name.to_owned(), value };
        let one = |hypothesis, found: Vec<Found>, inside| Contestant { hypothesis, found, steps: 60, inside };
        let of = |mean| Difference { mean, error: 0.02, views: 9 };
        let evidence = Evidence {
            predicted: of(0.11),
            straight_through: of(0.01),
            other_photographs: of(0.0),
            trained_straight: of(0.45),
            above: of(0.1),
            index: Some([1.31, 1.4]),
        };
        let raced = RegionVerdict {
            region: 0,
            hypothesis: Hypothesis::Straight,
            gain_inside: -0.2,
            error: 0.1,
            gain_outside: 0.05,
            margin: 0.1,
            contestants: vec![
                one(Hypothesis::Straight, Vec::new(), 17.0),
                one(Hypothesis::Solid, vec![number("index", 1.5)], 16.8),
                one(Hypothesis::Vessel, vec![number("index", 1.5), number("filling", 1.33)], 16.0),
            ],
            found: Vec::new(),
            evidence: Some(evidence),
        };
        let sure = RegionVerdict {
            region: 1,
            hypothesis: Hypothesis::Solid,
            contestants: Vec::new(),
            found: vec![number("index", 1.35)],
            ..raced.clone()
        };
        let silent = RegionVerdict { evidence: None, ..sure.clone() };
        let won = RegionVerdict { region: 2, contestants: raced.contestants[..1].to_vec(), ..silent.clone() };
        let verdict = Verdict {
            views: 9,
            seconds: 1.0,
            progress: 0.2,
            regions: vec![raced, sure, silent, won],
            proof: None,
        };
        let likeness = "likeness to 9 photographs kept aside: predicted 0.11 ± 0.02, straight through 0.01 ± 0.02, straight rays \
                        after training 0.45 ± 0.02, other photographs 0.00 ± 0.02";
        let expected = [
            format!(
                "region 1: straight rays (bent rays -0.20 ± 0.10 dB inside, +0.05 dB outside, on 9 views kept aside; straight \
                 rays: 17.00 dB, a solid body of index 1.50: 16.80 dB, an open vessel of index 1.33: 16.00 dB; {likeness})"
            ),
            format!("region 2: a solid body, index 1.350, index 1.310 to 1.400 ({likeness})"),
            "region 2: a solid body, index 1.350".to_owned(),
            "region 3: a solid body, beginning with index 1.350 (bent rays -0.20 ± 0.10 dB inside, +0.05 dB outside, on 9 views kept \
             aside; straight rays: 17.00 dB)"
                .to_owned(),
        ];
        assert_eq!(verdict_text(&verdict).lines().collect::<Vec<_>>(), expected);
    }
}
