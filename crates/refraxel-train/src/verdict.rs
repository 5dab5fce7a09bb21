//! What stands in a refractive region: the hypotheses that compete, and the verdict on them.

pub use crate::evidence::Difference;
pub use crate::silhouettes::LocateError;
use serde::{Deserialize, Serialize};

/// What may stand in a refractive region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Hypothesis {
    /// Nothing that rays should bend at: straight rays explain it better.
    Straight,
    /// A body of one index with a sharp surface.
    Solid,
    /// A convex body of one index with flat faces.
    Polyhedron,
    /// A body of one index with a transition of some voxels.
    Smooth,
    /// A body with a wall and air in it.
    Shell,
    /// An open vessel, empty or filled with water up to a level.
    Vessel,
    /// Water below an open surface that is seen from above only.
    WaterSurface,
    /// A lens: w = n²/2 rises from ½ at the surface to its largest value in the middle, as a power of a parabola of the depth.
    Graded,
    /// What a file says.
    #[serde(alias = "context")]
    Known,
}

impl Hypothesis {
    /// As people say it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Straight => "straight rays",
            Self::Solid => "a solid body",
            Self::Polyhedron => "a polyhedron",
            Self::Smooth => "a body with a soft edge",
            Self::Shell => "a shell with air in it",
            Self::Vessel => "an open vessel",
            Self::WaterSurface => "water seen from above",
            Self::Graded => "an index gradient",
            Self::Known => "the index of a file",
        }
    }
}

/// A number that a search found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Found {
    /// What it is: `index`, `wall`, `base`, `foot`, `offset`, `power`, `water` or `level`.
    pub name: String,
    /// Its value: the index [1], the thickness of a wall [depth of the body], how far the surface lies outside the hull
    /// [voxel], how steeply the index of a lens rises (1: as a parabola), how high water stands in a vessel [height of the
    /// vessel], the level of water seen from above [range that the masks allow].
    pub value: f32,
}

/// A hypothesis after its race.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Contestant {
    /// What it assumes.
    pub hypothesis: Hypothesis,
    /// The numbers that it began with; none of straight rays.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub found: Vec<Found>,
    /// Steps that it learned.
    pub steps: u64,
    /// Mean PSNR of the views kept aside, inside the masks where they show the region [dB]; −∞, in JSON `null`, where none shows it
    /// or the hypothesis diverged.
    #[serde(with = "or_null")]
    pub inside: f64,
}

/// What was decided about a region, and why.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RegionVerdict {
    /// Number of the region, from 0, as it was found.
    pub region: usize,
    /// What stands there.
    pub hypothesis: Hypothesis,
    /// By how much the best bent hypothesis is better than straight rays inside the masks, in the mean over the views kept
    /// aside [dB]; −∞, in JSON `null`, where nothing says so.
    #[serde(with = "or_null")]
    pub gain_inside: f64,
    /// Standard error of this mean [dB].
    #[serde(with = "or_null")]
    pub error: f64,
    /// The same outside the masks [dB].
    #[serde(with = "or_null", default = "unknown")]
    pub gain_outside: f64,
    /// What `gain_inside` had to reach [dB].
    pub margin: f64,
    /// Everything that raced, the best first.
    #[serde(default)]
    pub contestants: Vec<Contestant>,
    /// The numbers that rays bend by at first.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub found: Vec<Found>,
    /// What prediction without training says. Where nothing raced, this decided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<Evidence>,
}

impl RegionVerdict {
    /// By prediction.
    pub(crate) fn predicted(
        region: usize,
        hypothesis: Hypothesis,
        found: Vec<Found>,
        evidence: Option<Evidence>,
    ) -> Self {
        let unknown = unknown();
        Self {
            region,
            hypothesis,
            gain_inside: unknown,
            error: unknown,
            gain_outside: unknown,
            margin: 0.0,
            contestants: Vec::new(),
            found,
            evidence,
        }
    }
}

/// How alike in structure, theory (4.24), pictures of a region are to the photographs of views kept aside: −1 to 1, in the mean over
/// these views.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Evidence {
    /// What rays bent by the candidate should show, before anything of it has learned.
    pub predicted: Difference,
    /// What would be seen straight through, if nothing stood there.
    pub straight_through: Difference,
    /// The prediction, compared with the photographs of other views.
    pub other_photographs: Difference,
    /// What straight rays show that have learned the inside.
    pub trained_straight: Difference,
    /// By how much the prediction is more alike than looking straight through, view by view.
    pub above: Difference,
    /// Where the index lies: beyond, the prediction is clearly less alike.
    pub index: Option<[f32; 2]>,
}

fn unknown() -> f64 {
    f64::NEG_INFINITY
}

/// Decibels that may be −∞, which JSON cannot say.
mod or_null {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    pub fn serialize<S: Serializer>(value: &f64, to: S) -> Result<S::Ok, S::Error> {
        Some(value).filter(|v| v.is_finite()).serialize(to)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(from: D) -> Result<f64, D::Error> {
        Ok(Option::deserialize(from)?.unwrap_or(f64::NEG_INFINITY))
    }
}

/// What the judge decided.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Verdict {
    /// Views kept aside until the decision.
    pub views: usize,
    /// Share of the run at which the decision began.
    pub progress: f64,
    /// Time that the decision took, the search included [s].
    pub seconds: f64,
    /// One per region that was found.
    pub regions: Vec<RegionVerdict>,
    /// How bent rays stood later against what straight ones had learned when it was decided.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub proof: Option<Proof>,
}

/// Bent rays halfway between the decision and the end, on views that had still not been learned from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Proof {
    /// Share of the run that was over.
    pub progress: f64,
    /// By how much they were better inside refractive masks, in the mean over the views [dB]; none where no view says so.
    pub inside: Option<f64>,
    /// The same beside them.
    pub outside: Option<f64>,
}

impl Proof {
    /// They were worse inside or beside: rays are straight again.
    pub fn is_failed(self) -> bool {
        [self.inside, self.outside].into_iter().flatten().any(|gain| gain < 0.0)
    }
}

/// Mean squared errors of some views that nothing has learned from, in the order of the views; none where there are too few pixels.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Baseline {
    /// Inside refractive masks.
    pub inside: Vec<Option<f64>>,
    /// Beside them.
    pub outside: Vec<Option<f64>>,
}

impl Verdict {
    /// Whether rays bend in some region.
    pub fn bends(&self) -> bool {
        let given_up = self.proof.is_some_and(Proof::is_failed);
        !given_up && self.regions.iter().any(|r| r.hypothesis != Hypothesis::Straight)
    }
}

/// Why rays that were to bend stay straight.
#[derive(Clone, Debug, PartialEq, thiserror::Error, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum StayReason {
    /// Nothing refractive was found.
    #[error(transparent)]
    NotFound(#[from] LocateError),
    /// No masks, and straight rays explain the photographs.
    #[error(
        "no masks mark refractive regions, and straight rays explain all photographs; if there is glass or water, mark it by masks \
         (`refraxel mask DATA` makes them from clicks)"
    )]
    Unnoticed,
    /// No masks, and a run whose detection would take too large a part of it.
    #[error(
        "no masks mark refractive regions, and the run is too short to search for them; give it more time or steps, or masks"
    )]
    TooShortToLook,
    /// All photographs are taken from one place.
    #[error(
        "all photographs are taken from one point, from which outlines determine no shape; take some from elsewhere, or \
         name a known shape with --index-from"
    )]
    OnePlace,
    /// A box was given, and nothing says what is in it.
    #[error(
        "the box says where to look, but without masks the shape in it is unknown; give masks, or choose a shape that \
         fills the box with --set shape.start=ball or --set shape.start=block"
    )]
    OnlyABox,
    /// Bent rays explain views that they have not learned from worse than straight ones did before.
    #[error(
        "halfway to the end, bent rays explain the views kept aside worse than straight rays did at the decision \
         (--refraction on forces bent rays)"
    )]
    FellBehind,
    /// Straight rays explain the views that were kept aside better, or as well.
    #[error(
        "straight rays explain the views kept aside as well as bent rays do (--refraction on forces bent rays)"
    )]
    Judged,
    /// The run is too short for a race, and no hypothesis fits clearly better than straight rays do.
    #[error(
        "the run is too short for hypotheses to race, and none of them explains the photographs better than straight rays; \
         give it more time or steps, or force bent rays with --refraction on"
    )]
    TooShort,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_verdict_on_what_no_view_shows_comes_back_from_json() {
        let nothing = f64::NEG_INFINITY;
        let contestant =
            Contestant { hypothesis: Hypothesis::Straight, found: Vec::new(), steps: 3, inside: nothing };
        let verdict = RegionVerdict {
            region: 1,
            hypothesis: Hypothesis::Straight,
            gain_inside: nothing,
            error: 0.0,
            gain_outside: 1.5,
            margin: 0.3,
            contestants: vec![contestant],
            found: Vec::new(),
            evidence: None,
        };
        let text = serde_json::to_string(&verdict).unwrap();
        assert_eq!(serde_json::from_str::<RegionVerdict>(&text).unwrap(), verdict, "{text}");
    }
}
