//! The race between hypotheses and straight rays, and the judge's verdict: successive halving (Karnin, Koren & Somekh 2013)
//! on the views that were kept aside.
//!
//! Everything here works on scores alone. Whoever trains is behind [`Trials`].

use crate::cancel::Cancelled;
use crate::verdict::{Contestant, Found, Hypothesis, RegionVerdict};

/// Bent rays must be better than straight ones inside the masks by this much, and may be worse outside of them by so much [dB].
const MARGIN: f64 = 0.3;
const TOLERANCE: f64 = 0.2;
/// Bent rays must be better by so many standard errors. Few views have a large error that is hardly known itself.
const CARE: f64 = 0.5;

/// Bent rays that lead by so many margins, and by so many standard errors, after the first round have won. Straight rays never
/// have: at first bent ones are behind, because what stands inside is cleared, and catch up.
const CLEAR: f64 = 2.0;
/// Flat faces that are behind a free surface by no more than this after the first round go on [dB]. A surface that may bend everywhere learns
/// what the views want sooner, and goes on to dent: of a tank it led by 0.5 dB after 100 steps and was 3 dB behind after 12,000.
const TIE: f64 = 1.0;
/// Fewer views that show a region have no standard error to speak of.
const SOME_VIEWS: usize = 3;

/// Number of a trial. Number 0 is straight rays.
pub(super) type TrialIndex = usize;
/// Straight rays.
pub(super) const STRAIGHT: TrialIndex = 0;

/// Mean squared errors of one view that was kept aside, of an entry.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct ViewScore {
    /// Per region, of the pixels inside masks that show it; none where there are too few.
    pub inside: Vec<Option<f64>>,
    /// Of the pixels outside masks; none where there are too few.
    pub outside: Option<f64>,
}

/// Whoever trains the entries and scores them.
pub(super) trait Trials {
    /// Let an entry learn so many more steps.
    fn learn(&mut self, entry: TrialIndex, steps: u64) -> Result<(), Cancelled>;
    /// How well it renders each view that was kept aside.
    fn scores(&mut self, entry: TrialIndex) -> Result<Vec<ViewScore>, Cancelled>;
    /// The entry in which each region has its hypothesis of this entry: a new one, or an old one that is the same.
    fn combined(&mut self, chosen: &[TrialIndex]) -> TrialIndex;
    /// What an entry assumes of a region, with its numbers.
    fn assumes(&self, entry: TrialIndex, region: usize) -> (Hypothesis, Vec<Found>);
}

/// How long a race is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct TrialLength {
    /// Regions on which entries compete.
    pub regions: usize,
    /// Entries at the start, straight rays included.
    pub entries: usize,
    /// Steps of the first round, for all.
    pub first: u64,
    /// Steps in all, for straight rays and the best other.
    pub all: u64,
    /// Steps after which a race ends that goes on because its end is open.
    pub most: u64,
}

/// An entry with what it learned and how it scored last.
struct Standing {
    entry: TrialIndex,
    steps: u64,
    scores: Vec<ViewScore>,
}

/// What came of a race.
#[derive(Debug)]
pub(super) struct Outcome {
    /// The entry that won where it wins.
    pub finalist: TrialIndex,
    /// One per region.
    pub verdicts: Vec<RegionVerdict>,
}

/// First all entries learn for a while. The best hypothesis of each region goes on against straight rays, unless it leads
/// clearly by then. Where straight rays are ahead at the end and bent ones come nearer so fast that they would win, the race
/// goes on, as long again each time.
pub(super) fn race(trials: &mut impl Trials, length: TrialLength) -> Result<Outcome, Cancelled> {
    let mut standings = Vec::new();
    for entry in 0..length.entries {
        trials.learn(entry, length.first)?;
        standings.push(Standing { entry, steps: length.first, scores: trials.scores(entry)? });
    }
    let best = |region: usize| {
        let bent = || standings[1..].iter();
        let kind = |s: &Standing| trials.assumes(s.entry, region).0;
        let Some(best) = bent().max_by(|a, b| a.inside(region).total_cmp(&b.inside(region))) else {
            return STRAIGHT;
        };
        let ties = |s: &&Standing| {
            kind(best) == Hypothesis::Solid
                && kind(s) == Hypothesis::Polyhedron
                && s.inside(region) >= best.inside(region) - TIE
        };
        let faces = bent().filter(ties).max_by(|a, b| a.inside(region).total_cmp(&b.inside(region)));
        faces.unwrap_or(best).entry
    };
    let chosen: Vec<TrialIndex> = (0..length.regions).map(best).collect();
    let finalist = trials.combined(&chosen);
    let verdicts = |trials: &_, standings: &[Standing]| -> Vec<RegionVerdict> {
        (0..length.regions).map(|r| verdict(trials, standings, finalist, r)).collect()
    };
    if let Some(leader) = standings.iter().find(|s| s.entry == finalist) {
        let verdicts = verdicts(&*trials, &standings);
        if verdicts.iter().all(|v| v.is_clear() && leader.views(v.region) >= SOME_VIEWS) {
            return Ok(Outcome { finalist, verdicts });
        }
    }
    let trend = |region: usize| {
        let so_far = gains(&standings, chosen[region], |score| score.inside[region]);
        Trend::new(length.first, mean_and_error(&so_far).0)
    };
    let mut trends: Vec<Trend> = (0..length.regions).map(trend).collect();
    let mut until = length.all;
    loop {
        for entry in [STRAIGHT, finalist] {
            let so_far = standings.iter().find(|s| s.entry == entry).map_or(0, |s| s.steps);
            trials.learn(entry, until - so_far.min(until))?;
            let scores = trials.scores(entry)?;
            standings.retain(|s| s.entry != entry);
            standings.push(Standing { entry, steps: until, scores });
        }
        let verdicts = verdicts(&*trials, &standings);
        trends.iter_mut().zip(&verdicts).for_each(|(trend, v)| trend.add(until, v.gain_inside));
        let next = (until + length.all).min(length.most);
        let is_open = trends.iter().zip(&verdicts).any(|(trend, v)| trend.is_open(v, next));
        if !is_open || next == until {
            return Ok(Outcome { finalist, verdicts });
        }
        until = next;
    }
}

/// By how much an entry is better than straight rays, for each view of which both have a score of this kind [dB].
fn gains(standings: &[Standing], entry: TrialIndex, score: impl Fn(&ViewScore) -> Option<f64>) -> Vec<f64> {
    let of = |entry: TrialIndex| standings.iter().find(|s| s.entry == entry);
    let pairs = of(STRAIGHT).into_iter().zip(of(entry)).flat_map(|(s, b)| s.scores.iter().zip(&b.scores));
    pairs.filter_map(|(s, b)| Some(gain(score(s)?, score(b)?))).collect()
}

/// How the lead of bent rays changes with the steps.
struct Trend {
    /// The last two: steps and lead [dB].
    points: [(u64, f64); 2],
}

impl Trend {
    fn new(steps: u64, gain: f64) -> Self {
        Self { points: [(steps, gain); 2] }
    }

    fn add(&mut self, steps: u64, gain: f64) {
        self.points = [self.points[1], (steps, gain)];
    }

    /// The lead after so many steps, if it goes on to change as it does [dB].
    fn at(&self, steps: u64) -> f64 {
        let [(t0, g0), (t1, g1)] = self.points.map(|(t, g)| (t as f64, g));
        if t1 > t0 { g1 + (g1 - g0) * (steps as f64 - t1) / (t1 - t0) } else { g1 }
    }

    /// Bent rays have not won, and would at the next end.
    fn is_open(&self, verdict: &RegionVerdict, next: u64) -> bool {
        verdict.hypothesis == Hypothesis::Straight
            && self.at(next) >= verdict.margin.max(CARE * verdict.error)
    }
}

/// The decision on one region.
fn verdict(
    trials: &impl Trials,
    standings: &[Standing],
    finalist: TrialIndex,
    region: usize,
) -> RegionVerdict {
    let inside = gains(standings, finalist, |score| score.inside[region]);
    let outside = gains(standings, finalist, |score| score.outside);
    let (gain_inside, error) = mean_and_error(&inside);
    let gain_outside = mean_and_error(&outside).0;
    let spares_the_rest = outside.is_empty() || gain_outside >= -TOLERANCE;
    let wins = gain_inside >= MARGIN.max(CARE * error) && spares_the_rest;
    let (hypothesis, _) = trials.assumes(finalist, region);
    let mut contestants: Vec<Contestant> = standings.iter().map(|s| s.contestant(trials, region)).collect();
    contestants.sort_by(|a, b| b.steps.cmp(&a.steps).then(b.inside.total_cmp(&a.inside)));
    RegionVerdict {
        region,
        hypothesis: if wins { hypothesis } else { Hypothesis::Straight },
        gain_inside,
        error,
        gain_outside,
        margin: MARGIN,
        contestants,
        found: Vec::new(),
        evidence: None,
    }
}

impl RegionVerdict {
    /// Bent rays have won, whatever else they learn.
    fn is_clear(&self) -> bool {
        self.hypothesis != Hypothesis::Straight
            && self.gain_inside > 0.0
            && self.gain_inside >= CLEAR * self.margin.max(self.error)
    }
}

impl Standing {
    /// Mean PSNR inside the masks of a region [dB]; −∞ where nothing shows it or the entry diverged.
    fn inside(&self, region: usize) -> f64 {
        let psnr: Vec<f64> = self.scores.iter().filter_map(|s| s.inside[region]).map(decibel).collect();
        let mean = psnr.iter().sum::<f64>() / psnr.len() as f64;
        if mean.is_nan() { f64::NEG_INFINITY } else { mean }
    }

    /// How many views show a region.
    fn views(&self, region: usize) -> usize {
        self.scores.iter().filter(|s| s.inside[region].is_some()).count()
    }

    fn contestant(&self, trials: &impl Trials, region: usize) -> Contestant {
        let (hypothesis, found) = trials.assumes(self.entry, region);
        Contestant { hypothesis, found, steps: self.steps, inside: self.inside(region) }
    }
}

fn decibel(squared_error: f64) -> f64 {
    -10.0 * squared_error.log10()
}

/// How much better `b` is than `a` [dB].
pub(super) fn gain(a: f64, b: f64) -> f64 {
    decibel(b) - decibel(a)
}

/// Mean and its standard error. Without values the mean says nothing for bent rays.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    if values.is_empty() || mean.is_nan() {
        return (f64::NEG_INFINITY, 0.0);
    }
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    (mean, (squares / (n * (n - 1.0).max(1.0))).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Entries whose squared errors are stated: per entry and region.
    struct Injected {
        inside: Vec<Vec<f64>>,
        outside: Vec<f64>,
        learned: Vec<u64>,
        kinds: [Hypothesis; 4],
    }

    impl Injected {
        fn new(inside: Vec<Vec<f64>>, outside: Vec<f64>) -> Self {
            let learned = vec![0; inside.len()];
            let kinds = [Hypothesis::Straight, Hypothesis::Solid, Hypothesis::Graded, Hypothesis::Shell];
            Self { inside, outside, learned, kinds }
        }

        fn race(&mut self) -> Outcome {
            let length = TrialLength {
                regions: self.inside[0].len(),
                entries: self.inside.len(),
                first: 10,
                all: 30,
                most: 80,
            };
            race(self, length).unwrap()
        }
    }

    impl Trials for Injected {
        fn learn(&mut self, entry: TrialIndex, steps: u64) -> Result<(), Cancelled> {
            self.learned[entry] += steps;
            Ok(())
        }
        fn scores(&mut self, entry: TrialIndex) -> Result<Vec<ViewScore>, Cancelled> {
            let view = |k: f64| ViewScore {
                inside: self.inside[entry].iter().map(|e| Some(e * k)).collect(),
                outside: Some(self.outside[entry] * k),
            };
            Ok(vec![view(1.0), view(1.3), view(0.7)])
        }
        fn combined(&mut self, chosen: &[TrialIndex]) -> TrialIndex {
            if chosen.iter().all(|e| *e == chosen[0]) {
                return chosen[0];
            }
            self.inside.push(chosen.iter().enumerate().map(|(r, e)| self.inside[*e][r]).collect());
            self.outside.push(self.outside[chosen[0]]);
            self.learned.push(0);
            self.learned.len() - 1
        }
        fn assumes(&self, entry: TrialIndex, _: usize) -> (Hypothesis, Vec<Found>) {
            (self.kinds[entry.min(3)], Vec::new())
        }
    }

    #[test]
    fn the_best_hypothesis_goes_on_and_wins_where_it_is_better_than_straight_rays() {
        let mut trials = Injected::new(vec![vec![0.04], vec![0.038], vec![0.036]], vec![0.01; 3]);
        let outcome = trials.race();
        assert_eq!(trials.learned, [30, 10, 30]);
        let verdict = &outcome.verdicts[0];
        assert_eq!((outcome.finalist, verdict.hypothesis), (2, Hypothesis::Graded));
        assert!(
            (verdict.gain_inside - 10.0 * (0.04_f64 / 0.036).log10()).abs() < 1e-9 && verdict.error < 1e-9
        );
        let order: Vec<_> = verdict.contestants.iter().map(|c| c.hypothesis).collect();
        assert_eq!(order, [Hypothesis::Graded, Hypothesis::Straight, Hypothesis::Solid]);
    }

    #[test]
    fn flat_faces_go_on_where_a_free_surface_leads_by_little() {
        let finalist = |solid: f64, polyhedron: f64| {
            let mut trials = Injected::new(vec![vec![0.08], vec![solid], vec![polyhedron]], vec![0.01; 3]);
            trials.kinds[2] = Hypothesis::Polyhedron;
            trials.race().verdicts[0].hypothesis
        };
        assert_eq!(finalist(0.020, 0.025), Hypothesis::Polyhedron, "0.97 dB behind");
        assert_eq!(finalist(0.020, 0.026), Hypothesis::Solid, "1.14 dB behind");
        assert_eq!(finalist(0.021, 0.020), Hypothesis::Polyhedron);
    }

    /// Bent rays whose lead after some steps [dB] is stated.
    struct Late {
        lead: fn(u64) -> f64,
        learned: [u64; 2],
    }

    impl Trials for Late {
        fn learn(&mut self, entry: TrialIndex, steps: u64) -> Result<(), Cancelled> {
            self.learned[entry] += steps;
            Ok(())
        }
        fn scores(&mut self, entry: TrialIndex) -> Result<Vec<ViewScore>, Cancelled> {
            let lead = if entry == STRAIGHT { 0.0 } else { (self.lead)(self.learned[entry]) };
            let view = |k: f64| ViewScore {
                inside: vec![Some(0.04 * k * 10.0_f64.powf(-0.1 * lead))],
                outside: Some(0.01),
            };
            Ok([1.0, 1.3, 0.7].map(view).to_vec())
        }
        fn combined(&mut self, chosen: &[TrialIndex]) -> TrialIndex {
            chosen[0]
        }
        fn assumes(&self, entry: TrialIndex, _: usize) -> (Hypothesis, Vec<Found>) {
            (if entry == STRAIGHT { Hypothesis::Straight } else { Hypothesis::Solid }, Vec::new())
        }
    }

    #[test]
    fn a_race_goes_on_as_long_as_bent_rays_come_near_and_no_longer() {
        let race = |lead: fn(u64) -> f64| {
            let mut trials = Late { lead, learned: [0; 2] };
            let length = TrialLength { regions: 1, entries: 2, first: 10, all: 30, most: 80 };
            let outcome = race(&mut trials, length).unwrap();
            (outcome.verdicts[0].hypothesis, trials.learned)
        };
        assert_eq!(race(|t| 0.02 * t as f64 - 0.7), (Hypothesis::Solid, [60; 2]), "catches up");
        assert_eq!(race(|t| 0.02 * t as f64 - 1.4), (Hypothesis::Straight, [30; 2]), "too slow");
        assert_eq!(
            race(|t| 0.02 * t as f64 - 0.9 - 0.01 * t.saturating_sub(30) as f64),
            (Hypothesis::Straight, [60; 2]),
            "slows down"
        );
        assert_eq!(
            race(|t| -30.0 / t as f64),
            (Hypothesis::Straight, [60; 2]),
            "will be as good, not better"
        );
        assert_eq!(race(|t| -0.01 * t as f64), (Hypothesis::Straight, [30; 2]), "falls behind");
    }

    #[test]
    fn a_clear_lead_after_the_first_round_ends_the_race() {
        let mut trials = Injected::new(vec![vec![0.04], vec![0.02], vec![0.03]], vec![0.01; 3]);
        let outcome = trials.race();
        assert_eq!((outcome.finalist, trials.learned), (1, vec![10, 10, 10]));
        assert_eq!(outcome.verdicts[0].hypothesis, Hypothesis::Solid);
        let mut behind = Injected::new(vec![vec![0.02], vec![0.04]], vec![0.01; 2]);
        assert_eq!((behind.race().finalist, behind.learned), (1, vec![30, 30]), "who is behind may catch up");
        let mut mixed = Injected::new(vec![vec![0.04, 0.04], vec![0.02, 0.0395]], vec![0.01; 2]);
        mixed.race();
        assert_eq!(mixed.learned, [30, 30], "one region is not clear");
    }

    #[test]
    fn a_tie_a_loss_and_a_loss_outside_are_straight() {
        for (inside, outside) in [(0.04, 0.01), (0.05, 0.01), (0.01, 0.012), (f64::NAN, 0.01)] {
            let mut trials = Injected::new(vec![vec![0.04], vec![inside]], vec![0.01, outside]);
            let verdict = &trials.race().verdicts[0];
            assert_eq!(verdict.hypothesis, Hypothesis::Straight, "{inside} {outside}");
        }
    }

    #[test]
    fn each_region_takes_its_own_best_and_may_lose_alone() {
        let inside = vec![vec![0.04, 0.04, 0.04], vec![0.02, 0.01, 0.05], vec![0.01, 0.02, 0.06]];
        let mut trials = Injected::new(inside, vec![0.01; 3]);
        let outcome = trials.race();
        assert_eq!((outcome.finalist, trials.learned[3]), (3, 30), "a new combination learns from the start");
        let lost: Vec<bool> = outcome.verdicts.iter().map(|v| v.hypothesis == Hypothesis::Straight).collect();
        assert_eq!(lost, [false, false, true]);
    }

    #[test]
    fn views_that_disagree_decide_nothing() {
        let (mean, error) = mean_and_error(&[4.0, -3.0, 1.0, -1.0]);
        assert!((mean - 0.25).abs() < 1e-12 && error > mean);
        assert_eq!(mean_and_error(&[]).0, f64::NEG_INFINITY);
    }
}
