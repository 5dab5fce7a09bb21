//! Processes that train one model together, theory (4.19).
//!
//! One of them, the first, leads: it has the photographs, takes all decisions and saves. The others
//! [serve](crate::cpu::serve): each holds a copy of the model, follows its share of every batch of rays, and owns a
//! share of the voxels. What one process has computed of another's voxels travels by [`Communicator::exchange`]; no gradient of the
//! whole field ever exists. Sums are taken in the order in which one process takes them: the result has the same bits.

pub mod threads;
pub(crate) mod wire;

use std::ops::Range;

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

/// Of `n` things in a row, those of a process: as many as of any other, give or take one.
pub fn part(n: usize, rank: usize, count: usize) -> Range<usize> {
    n * rank / count..n * (rank + 1) / count
}

/// What processes have sent to others [byte]; messages of a process to itself do not count.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize)]
pub struct Traffic {
    /// Rays to follow, and what is asked of them.
    pub rays: u64,
    /// Samples of the field, to the owners of the voxels around them.
    pub samples: u64,
    /// Samples of the index, of mirrors and of the background, to all.
    pub shared: u64,
    /// Voxels that have changed, to all.
    pub voxels: u64,
    /// What rays show, to the first.
    pub pixels: u64,
    /// Models and media, to all.
    pub models: u64,
}

impl Traffic {
    /// All of it.
    pub fn total(&self) -> u64 {
        self.counts().iter().sum()
    }

    fn counts(&self) -> [u64; 6] {
        let Self { rays, samples, shared, voxels, pixels, models } = *self;
        [rays, samples, shared, voxels, pixels, models]
    }

    fn of([rays, samples, shared, voxels, pixels, models]: [u64; 6]) -> Self {
        Self { rays, samples, shared, voxels, pixels, models }
    }
}

impl std::ops::Add for Traffic {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let (a, b) = (self.counts(), other.counts());
        Self::of(std::array::from_fn(|k| a[k] + b[k]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_and_are_as_large_as_each_other() {
        for (n, count) in [(0, 3), (7, 2), (64, 5), (3, 4)] {
            let parts: Vec<_> = (0..count).map(|rank| part(n, rank, count)).collect();
            assert!(parts.iter().flat_map(Clone::clone).eq(0..n));
            let sizes: Vec<usize> = parts.iter().map(ExactSizeIterator::len).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
        }
    }
}
