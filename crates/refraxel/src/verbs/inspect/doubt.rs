//! What may be wrong with one view, in words.

use refraxel_data::Severity;
use refraxel_data::inspect::Finding;

/// Of one kind so many are told one by one; a line counts the others.
const TOLD: usize = 6;

/// What may be wrong with a view; in the order in which it is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The file cannot be decoded.
    Unreadable,
    /// Nothing but black, white, or another colour.
    Empty,
    Blurred,
    Exposed,
    Clipped,
    /// The same picture as that of another view.
    Same,
    /// The pose of another view with another picture.
    SamePose,
    LooksAway,
    FarAway,
    MaskEmpty,
    MaskFull,
    MaskOdd,
    MaskCut,
}

impl Kind {
    fn severity(self) -> Severity {
        if self == Self::MaskCut { Severity::Note } else { Severity::Warning }
    }

    /// What is true of the views that are only counted.
    fn of_more(self) -> &'static str {
        match self {
            Self::Unreadable => "cannot be decoded",
            Self::Empty => "show nothing",
            Self::Blurred => "are blurred",
            Self::Exposed => "are darker or brighter than their neighbours",
            Self::Clipped => "are overexposed",
            Self::Same => "are duplicates of others",
            Self::SamePose => "have the pose of another one",
            Self::LooksAway => "look away from the scene",
            Self::FarAway => "stand far away",
            Self::MaskEmpty => "have an empty mask",
            Self::MaskFull => "have a mask that covers everything",
            Self::MaskOdd => "have a mask unlike those of their neighbours",
            Self::MaskCut => "have a mask that reaches the border of the photograph",
        }
    }
}

/// One doubt about one view.
#[derive(Clone, Debug, PartialEq)]
pub struct Doubt {
    /// Index of the view.
    pub view: usize,
    /// What is doubted.
    pub kind: Kind,
    /// The sentence: what was found and what to do.
    pub message: String,
    /// The same in a few words, for a picture.
    pub short: String,
}

impl Doubt {
    /// Whether it probably lowers quality.
    pub fn is_warning(&self) -> bool {
        self.kind.severity() == Severity::Warning
    }
}

/// The doubts as lines, kind by kind; of a kind that many views share, the first few and the number of the others.
pub fn told(doubts: &[Doubt]) -> Vec<Finding> {
    let mut kinds: Vec<Kind> = doubts.iter().map(|d| d.kind).collect();
    kinds.sort_unstable();
    kinds.dedup();
    let mut lines = Vec::new();
    for kind in kinds {
        let of_kind: Vec<&Doubt> = doubts.iter().filter(|d| d.kind == kind).collect();
        let line = |message: String| Finding { severity: kind.severity().name(), message };
        lines.extend(of_kind.iter().take(TOLD).map(|d| line(d.message.clone())));
        let more = of_kind.len().saturating_sub(TOLD);
        if more > 0 {
            lines.push(line(format!("{more} more views {}; --json names them", kind.of_more())));
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_doubts_of_a_kind_are_counted() {
        let doubt = |view, kind| Doubt { view, kind, message: format!("view {view}"), short: String::new() };
        let mut doubts: Vec<Doubt> = (0..20).map(|k| doubt(k, Kind::Blurred)).collect();
        doubts.push(doubt(3, Kind::Unreadable));
        let lines = told(&doubts);
        assert_eq!(lines.len(), 1 + TOLD + 1);
        assert_eq!(lines[0].message, "view 3", "the worst kind comes first");
        assert_eq!(lines[7].message, "14 more views are blurred; --json names them");
    }
}
