//! A part of the work that is shown in its place.

/// A part of the work that has a count of its own, such as "index search 12/63".
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Subtask<'a> {
    /// Name of the subtask.
    pub name: &'a str,
    /// Parts done so far.
    pub done: u64,
    /// Parts in all; `None` while the end is not known.
    pub total: Option<u64>,
}
