//! The judge: what prediction says of views kept aside, and the race where that stays open.

use super::Switch;
use super::section::section;

section! {
    /// The judge. Some training views are kept aside until the decision: what should be seen through a body, before anything of it is
    /// learned, is compared with them. Where that says nothing, usual bodies race against straight rays: each learns for some steps on
    /// the grid of that time, and the views kept aside score it.
    pub struct JudgeOptions "judge" {
        /// Whether there is a judge. Otherwise the prediction that is most alike is taken.
        enabled: Switch = Switch::On;
        /// Whether straight rays may win. `--refraction on` switches this off.
        straight: Switch = Switch::On;
    }
}
