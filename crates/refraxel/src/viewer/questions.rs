//! What a page asks of the painter: of each kind the latest, so that no page can make others wait by asking much.

use super::protocol::Ask;
use crate::locked::locked;
use std::mem::{discriminant, take};
use std::sync::Mutex;

/// Questions in the order of their kinds' first one: at most one of each kind.
#[derive(Debug, Default)]
pub struct Questions(Vec<Ask>);

impl Questions {
    /// Adds a question in the place of the earlier one of its kind, whose answer nobody wants any more.
    pub fn put(&mut self, ask: Ask) {
        match self.0.iter_mut().find(|earlier| discriminant(*earlier) == discriminant(&ask)) {
            Some(earlier) => *earlier = ask,
            None => self.0.push(ask),
        }
    }

    /// The question that waits longest.
    pub fn take_first(&mut self) -> Option<Ask> {
        (!self.0.is_empty()).then(|| self.0.remove(0))
    }

    /// Whether nothing is asked.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

/// Questions on their way from a page to the painter.
#[derive(Debug, Default)]
pub struct Mailbox(Mutex<Questions>);

impl Mailbox {
    /// Puts a question in; whether the mailbox was empty before, so that its owner has to be told.
    pub fn put(&self, ask: Ask) -> bool {
        let mut questions = locked(&self.0);
        let was_empty = questions.is_empty();
        questions.put(ask);
        was_empty
    }

    /// Takes everything out.
    pub fn empty(&self) -> Vec<Ask> {
        take(&mut locked(&self.0).0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slice(at: f64) -> Ask {
        Ask::Slice { region: 0, axis: 2, at }
    }

    #[test]
    fn a_mailbox_holds_of_each_kind_the_latest_question_in_the_place_of_the_first() {
        let mailbox = Mailbox::default();
        assert!(mailbox.put(slice(0.0)));
        for k in 0..200_000 {
            assert!(!mailbox.put(Ask::Surface { region: k }));
            assert!(!mailbox.put(slice(k as f64)));
        }
        assert_eq!(mailbox.empty(), [slice(199_999.0), Ask::Surface { region: 199_999 }]);
        assert!(mailbox.put(slice(0.5)));
    }
}
