//! What straight rays showed when rays began to bend: bent rays that fall behind it do not stay.

use super::race::gain;
use super::trials::Errors;
use crate::backend::{Backend, Marching};
use crate::cancel::{Cancel, Cancelled};
use crate::rays::AsideView;
use crate::verdict::{Baseline, Proof};

/// What a backend shows of some views.
pub(crate) fn baseline(
    backend: &mut dyn Backend,
    views: &[AsideView],
    marching: &Marching,
    cancel: &Cancel,
) -> Result<Baseline, Cancelled> {
    backend.refresh_occupancy(marching);
    let (mut inside, mut outside) = (Vec::new(), Vec::new());
    for view in views {
        cancel.check()?;
        let errors = Errors::of(backend, view, marching);
        inside.push(errors.mean(|k| view.inside[k]));
        outside.push(errors.mean(|k| !view.inside[k]));
    }
    Ok(Baseline { inside, outside })
}

/// How much better what was reached is, after this share of a run.
pub(crate) fn proof(before: &Baseline, reached: &Baseline, progress: f64) -> Proof {
    let mean = |before: &[Option<f64>], after: &[Option<f64>]| {
        let gains: Vec<f64> =
            before.iter().zip(after).filter_map(|(a, b)| Some(gain((*a)?, (*b)?))).collect();
        (!gains.is_empty()).then(|| gains.iter().sum::<f64>() / gains.len() as f64)
    };
    let (inside, outside) = (mean(&before.inside, &reached.inside), mean(&before.outside, &reached.outside));
    Proof { progress, inside, outside }
}
