//! Throughput of a device other than the CPU, on the scene and the rays of the others.

use super::objective::{MARCHING, objective};
use super::options::BenchOptions;
use super::rays::{coherent_batch, random_batch};
use super::scene::model;
use super::timing::best;
use crate::backend::{Batch, Layers};
use crate::model::Model;
use crate::session::{BackendError, IntoBackend};
use serde::Serialize;

/// Steps that are submitted before anybody waits, as in training.
const STEPS: u64 = 8;

/// Millions of samples per second of a device as a whole, straight rays.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct DeviceThroughput {
    /// Rendering, coherent rays.
    pub forward_msamples_per_s: f64,
    /// Rendering, random rays.
    pub forward_random_msamples_per_s: f64,
    /// Training on random rays: forward, adjoint, gradient sums and optimiser step.
    pub train_msamples_per_s: f64,
    /// The same for coherent rays.
    pub train_coherent_msamples_per_s: f64,
    /// Rays per second of training on random rays.
    pub train_rays_per_s: f64,
}

/// Measure straight rays on a backend that `make` gives, or say why it has none.
pub fn straight_on<M: IntoBackend>(
    options: &BenchOptions,
    make: impl FnOnce(Model) -> M,
) -> Result<DeviceThroughput, BackendError> {
    let mut backend = make(model(options.resolution)).into_backend()?;
    let (random, coherent) = (random_batch(options.rays), coherent_batch(options.rays));
    let n = options.repetitions;
    let mut train = |batch: &Batch| {
        let mut samples = 0;
        let seconds = best(n, || {
            (0..STEPS).for_each(|step| backend.submit(batch, &objective(), step));
            samples = backend.outcomes(true).iter().map(|o| o.samples).sum();
        });
        (samples as f64, seconds)
    };
    let ((random_samples, random_seconds), (coherent_samples, coherent_seconds)) =
        (train(&random), train(&coherent));
    let forward = |batch: &Batch, samples: f64| {
        let seconds = best(n, || drop(backend.render(&batch.rays, &MARCHING, Layers::All)));
        samples / STEPS as f64 / seconds / 1e6
    };
    let measured = DeviceThroughput {
        forward_msamples_per_s: forward(&coherent, coherent_samples),
        forward_random_msamples_per_s: forward(&random, random_samples),
        train_msamples_per_s: random_samples / random_seconds / 1e6,
        train_coherent_msamples_per_s: coherent_samples / coherent_seconds / 1e6,
        train_rays_per_s: STEPS as f64 * options.rays as f64 / random_seconds,
    };
    backend.fault().map_or(Ok(measured), |fault| Err(fault.into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CpuBackend;

    #[test]
    fn a_device_is_measured_by_the_samples_that_it_takes() {
        let options = BenchOptions { resolution: 16, rays: 64, repetitions: 1 };
        let found = straight_on(&options, CpuBackend::new).unwrap();
        let rays_of = |msamples: f64| msamples * 1e6 / found.train_rays_per_s;
        // A ray crosses about 16 voxels, and never more than the diagonal.
        let samples_per_ray = rays_of(found.train_msamples_per_s);
        assert!((8.0..28.0).contains(&samples_per_ray), "{samples_per_ray}");
        assert!(found.forward_msamples_per_s > 0.0 && found.forward_random_msamples_per_s > 0.0);
        let none = straight_on(&options, |_| Err::<CpuBackend, _>("no device"));
        assert_eq!(none.unwrap_err().to_string(), "no device");
    }
}
