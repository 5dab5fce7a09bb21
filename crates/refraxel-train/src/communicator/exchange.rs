//! How processes talk to each other.

/// The processes, as one of them sees them.
///
/// **Loss.** A process that is lost ends all others: there is nothing that they could do without its voxels.
pub trait Communicator: Send + Sync {
    /// The number of this process. The first, 0, leads.
    fn rank(&self) -> usize;
    /// How many there are.
    fn count(&self) -> usize;
    /// Sends each process its message, and returns what each has sent to this one; both by number. All processes call this together,
    /// and each of the following, too.
    fn exchange(&self, messages: Vec<Vec<u32>>) -> Vec<Vec<u32>>;
    /// What each process tells all others, by number.
    fn gather(&self, own: Vec<u32>) -> Vec<Vec<u32>> {
        self.exchange(vec![own; self.count()])
    }
    /// What the first process tells all others; what these give counts for nothing.
    fn broadcast(&self, message: Vec<u32>) -> Vec<u32> {
        let silent = || vec![Vec::new(); self.count()];
        let messages = if self.rank() == 0 { vec![message; self.count()] } else { silent() };
        self.exchange(messages).swap_remove(0)
    }
}
