//! The processes that train together.

use refraxel_train::cpu::Root;
use std::sync::Arc;

/// The processes that train together, as the first of them sees them.
#[derive(Clone)]
pub struct ProcessGroup {
    /// Its hold on the others.
    pub root: Arc<Root>,
    /// How many there are, with the first.
    pub count: usize,
}

/// How a process takes part in a training.
pub enum Joined {
    /// There is no other.
    Alone,
    /// It is the first of several.
    Leads(ProcessGroup),
    /// It has helped the first one, which needs it no more.
    Helped,
}
