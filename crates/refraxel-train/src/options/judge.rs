//! The judge: what prediction says of views kept aside, and the race where that stays open.

use super::Switch;
use super::section::section;

section! {
    /// The decision whether rays bend. Some training views are kept aside until then, and compared with the prediction of the view through
    /// each body, made before anything of it is learned. Where the prediction is inconclusive, usual bodies race against straight rays:
    /// each learns for some steps on the current grid, and the views kept aside score it.
    pub struct JudgeOptions "judge" {
        /// Whether views kept aside decide. Otherwise the candidate with the best prediction is taken.
        enabled: Switch = Switch::On;
        /// Whether straight rays may win. `--refraction on` switches this off.
        straight: Switch = Switch::On;
    }
}
