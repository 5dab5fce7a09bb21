//! How much has travelled.

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
