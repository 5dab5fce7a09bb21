//! How much is measured, and on which grid.

use serde::Serialize;
use std::fmt;
use std::str::FromStr;

/// Size and patience of a benchmark.
#[derive(Clone, Copy, Debug)]
pub struct BenchOptions {
    /// The grid of the scene.
    pub grid: BenchGrid,
    /// Rays of a batch.
    pub rays: usize,
    /// Repetitions; the best counts.
    pub repetitions: usize,
    /// Whether pictures are left out, which take the longest.
    pub is_quick: bool,
}

impl BenchOptions {
    /// A benchmark of a minute, or of a few seconds.
    pub fn suited_to(quick: bool) -> Self {
        let (rays, repetitions) = if quick { (4096, 3) } else { (16_384, 15) };
        Self { grid: BenchGrid::default(), rays, repetitions, is_quick: quick }
    }
}

/// The grid of the scene that is measured on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum BenchGrid {
    /// All voxels are stored, of so many nodes per axis.
    Dense(u32),
    /// Those in a shell of about six bricks around a sphere are stored, of 512 nodes per axis.
    Sparse,
}

impl BenchGrid {
    /// Nodes per axis.
    pub fn nodes(self) -> u32 {
        match self {
            Self::Dense(nodes) => nodes,
            Self::Sparse => 512,
        }
    }
}

impl Default for BenchGrid {
    fn default() -> Self {
        Self::Dense(128)
    }
}

impl fmt::Display for BenchGrid {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let nodes = self.nodes();
        match self {
            Self::Dense(_) => write!(f, "{nodes}³ voxels"),
            Self::Sparse => write!(f, "a shell of a grid of {nodes}³ voxels"),
        }
    }
}

/// The name of a grid was not understood.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{found}` is no grid; expected the number of nodes along each axis, from 8 to 1024, or sparse")]
pub struct UnknownGrid {
    /// What stood there.
    pub found: String,
}

impl FromStr for BenchGrid {
    type Err = UnknownGrid;

    fn from_str(text: &str) -> Result<Self, UnknownGrid> {
        let dense = || text.parse().ok().filter(|n| (8..=1024).contains(n)).map(Self::Dense);
        let grid = if text == "sparse" { Some(Self::Sparse) } else { dense() };
        grid.ok_or_else(|| UnknownGrid { found: text.to_owned() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grids_are_understood_by_their_names() {
        assert_eq!("256".parse(), Ok(BenchGrid::Dense(256)));
        assert_eq!("sparse".parse(), Ok(BenchGrid::Sparse));
        for text in ["", "7", "1025", "-8", "dense"] {
            let error = text.parse::<BenchGrid>().unwrap_err().to_string();
            assert!(error.contains("from 8 to 1024, or sparse"), "{error}");
        }
    }
}
