//! The race between hypotheses, and the judge.

use super::Switch;
use super::section::section;

section! {
    /// The race between what may stand in a refractive region, and the judge. Some training views are kept aside until the
    /// decision. Each hypothesis learns for some steps on the grid of that time; the views kept aside score it.
    pub struct JudgeOptions "judge" {
        /// Whether hypotheses race. Otherwise the one with the least error of the search is taken.
        enabled: Switch = Switch::On;
        /// Whether straight rays may win. `--refraction on` switches this off.
        straight: Switch = Switch::On;
        /// Share of the training views that is kept aside until the decision, at least 2 and at most 12 views.
        views: f64 = 0.15, in 0.0..=0.5;
        /// Most of a run that search and race may take; a race whose end is open, because bent rays come nearer, may take three times as
        /// long.
        cost: f64 = 0.15, in 0.0..=0.5;
        /// Most steps that a hypothesis learns in its race.
        race_steps: u64 = 300;
        /// Fewer steps say nothing: a short run races for so many, whatever they cost, and where water is seen from above for
        /// three times as many, within three tenths of the run. One of less than three times as many steps, and one whose
        /// clock they would take three tenths of, takes the least error of the search.
        least_steps: u64 = 60, in 3..;
        /// Bent rays must be better than straight ones inside the masks by this much [dB].
        margin: f64 = 0.3, in 0.0..=10.0, "dB";
        /// Outside the masks they may be worse than straight ones by this much [dB].
        tolerance: f64 = 0.2, in 0.0..=10.0, "dB";
        /// A hypothesis races if its error in the search is at most this factor of the least one.
        rivals: f64 = 1.3, in 1.0..=10.0;
    }
}
