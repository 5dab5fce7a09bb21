//! How views decide about a point.

/// How views decide about a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Vote {
    /// A point is inside when at least this share of the votes cast says so. Not all: opaque things occlude glass, masks
    /// and poses err. 0.95 of 100 views lets 5 of them disagree; where nothing occludes, use 1.
    pub share: f32,
    /// At least this many votes may be overruled, whatever the share says: of fewer than 20 votes, a share of 0.95 lets
    /// none disagree, and a single wrong mask carves. At most one vote in four; 0: the share alone decides.
    pub dissent: usize,
    /// Least share of the views that have the point in the picture that must vote: the ground under an object, which is
    /// hidden in most, is not refractive only because nothing contradicts it.
    pub least: f32,
    /// Fewer votes than this decide nothing, and the point is outside.
    pub views: usize,
    /// A view abstains whose line of sight misses the mask but ends at something opaque this far in front of the point
    /// [voxel].
    pub margin: f32,
}

impl Default for Vote {
    fn default() -> Self {
        Self { share: 0.95, dissent: 0, least: 0.3, views: 3, margin: 1.0 }
    }
}

/// Moves the votes that are cast to the front: how many they are. The others abstain with an infinite distance.
pub(super) fn cast(all: &mut [f32]) -> usize {
    let mut cast = 0;
    for v in 0..all.len() {
        if all[v].is_finite() {
            all[cast] = all[v];
            cast += 1;
        }
    }
    cast
}

/// The largest of the votes cast that is not overruled; `None` where too few of those views that see the point cast one.
/// Changes the order of the votes.
pub(super) fn decide(cast: &mut [f32], seen: usize, vote: &Vote) -> Option<f32> {
    const ROUNDING: f32 = 1e-4; // 20 views × (1 − 0.95) is one view
    const MOST_DISSENT: usize = 4; // `dissent` overrules at most one vote in four
    let count = cast.len();
    if count < vote.views.max(1) || (count as f32) < vote.least * seen as f32 - ROUNDING {
        return None;
    }
    let overruled = ((1.0 - vote.share) * count as f32 + ROUNDING) as usize;
    let rank = overruled.max(vote.dissent.min(count / MOST_DISSENT)).min(count - 1);
    Some(*cast.select_nth_unstable_by(rank, |a, b| b.total_cmp(a)).1)
}
