//! What a scene can be chosen by: its name, and what may be chosen about it.

use crate::synth::error::SynthError;
use crate::synth::shape::TriangleMesh;

/// What `refraxel synth --list` prints about a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneInfo {
    /// Name on the command line.
    pub name: &'static str,
    /// What it shows, in one sentence.
    pub shows: &'static str,
    /// The index that may be chosen: what it belongs to, its default and its range. `None`: fixed by a formula.
    pub ior: Option<IorRange>,
}

/// The index of a scene that may be chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IorRange {
    /// Used when no other is given.
    pub default: f64,
    /// Smallest allowed.
    pub min: f64,
    /// Largest allowed.
    pub max: f64,
}

/// Options of a scene.
#[derive(Clone, Debug, Default)]
pub struct SceneOptions {
    /// Choice of textures and of the turn of the surroundings; 0 is the usual picture.
    pub seed: u64,
    /// Index of the main refractive body instead of the default.
    pub ior: Option<f64>,
    /// Shape of the body in `glass_mesh` instead of the knot; fitted to the place of the ball.
    pub mesh: Option<TriangleMesh>,
}

/// A line of a list of scenes: what it shows, and what makes it.
pub(super) type Entry<T> = (SceneInfo, T);

pub(super) const GLASS: Option<IorRange> = matter(1.5);
pub(super) const WATER: Option<IorRange> = matter(1.33);
pub(super) const STONE: Option<IorRange> = matter(1.7);

/// The range of all clear matter, with another default.
pub(super) const fn matter(default: f64) -> Option<IorRange> {
    Some(IorRange { default, min: 1.0, max: 4.0 })
}

pub(super) const fn info(name: &'static str, shows: &'static str, ior: Option<IorRange>) -> SceneInfo {
    SceneInfo { name, shows, ior }
}

/// The line of a name in a list, with the index of its main body.
pub(super) fn chosen<T: Copy>(
    list: &[Entry<T>],
    name: &str,
    ior: Option<f64>,
) -> Result<(SceneInfo, T, f64), SynthError> {
    let Some(&(info, made_by)) = list.iter().find(|(info, _)| info.name == name) else {
        let known = list.iter().map(|(info, _)| info.name).collect::<Vec<_>>().join(", ");
        return Err(SynthError::UnknownScene { found: name.into(), known });
    };
    let range = |expected: String| {
        let found = ior.map_or(String::new(), |n| n.to_string());
        Err(SynthError::Range { option: "--ior", found, expected })
    };
    let ior = match (info.ior, ior) {
        (None, Some(_)) => return range(format!("nothing: the scene {name} has no index to choose")),
        (Some(r), Some(n)) if !(n >= r.min && n <= r.max) => {
            return range(format!("a number from {} to {} for the scene {name}", r.min, r.max));
        }
        (r, n) => n.or(r.map(|r| r.default)).unwrap_or(1.0),
    };
    Ok((info, made_by, ior))
}
