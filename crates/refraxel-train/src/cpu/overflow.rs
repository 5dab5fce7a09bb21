//! Tests: derivatives that leave the finite numbers are counted, and a step that moves a parameter there has failed.

use super::CpuBackend;
use super::absorption::{FilteredRay, LengthAdjoint};
use super::backend::overflows;
use super::record::{CLEARCOAT, CacheLookup};
use super::sample::RaySamples;
use super::tape::Tape;
use crate::backend::conformance::absorbing::tinted_ball;
use crate::backend::conformance::clearcoated::clearcoated_model;
use crate::backend::conformance::scenes::{environment, objective};
use crate::backend::{AbsorptionObjective, Objective, ReflectionObjective};
use crate::model::CacheId;
use refraxel_core::optics::{Options, Tracer};
use refraxel_core::{Extent, Ray, Vec3};

const MIRRORS: ReflectionObjective =
    ReflectionObjective { rate: 0.01, rate_strength: 0.01, rate_clearcoat: 0.01 };
/// Its square is too large for single precision.
const HUGE: f32 = 1e30;

fn learning() -> Objective {
    let absorption = Some(AbsorptionObjective { rate: 0.01 });
    Objective { reflection: Some(MIRRORS), absorption, rate_background: 0.01, ..objective() }
}

fn lookup(d_radiance: f32, d_strength: f32) -> CacheLookup {
    CacheLookup {
        surface: 0,
        cache: CacheId { region: 0, inner: false },
        x: Vec3 { x: 0.5, y: 0.0, z: 0.0 },
        direction: Vec3 { x: 1.0, y: 0.0, z: 0.0 },
        d_radiance: [d_radiance; 3],
        d_strength,
    }
}

#[test]
fn a_background_mirror_or_absorption_that_is_no_number_fails_the_step() {
    let mut model = tinted_ball();
    model.background = environment();
    let of = |fill: fn(&mut Tape, f32), value: f32| {
        let mut tape = Tape::default();
        tape.absorption.resize(model.refraction.medium.regions().len(), [0.0; 3]);
        fill(&mut tape, value);
        CpuBackend::new(model.clone()).update_rest(&[tape], &learning())
    };
    let fills: [fn(&mut Tape, f32); 4] = [
        |tape, v| tape.texels.push((3, [v, 0.0, 0.0])),
        |tape, v| tape.lookups.push(lookup(v, 0.0)),
        |tape, v| tape.lookups.push(lookup(0.0, v)),
        |tape, v| tape.absorption[0][1] = f64::from(v),
    ];
    for (k, fill) in fills.into_iter().enumerate() {
        assert!(of(fill, 0.5), "array {k}");
        for value in [f32::NAN, f32::INFINITY] {
            assert!(!of(fill, value), "{value} in array {k}");
        }
    }
    assert!(!of(fills[3], HUGE), "moments of Adam must stay finite, too");
}

#[test]
fn a_clearcoat_that_is_no_number_fails_the_step() {
    for (d_radiance, d_strength) in
        [(f32::NAN, 0.0), (0.0, f32::NAN), (f32::INFINITY, 0.0), (0.0, f32::INFINITY)]
    {
        let mut tape = Tape::default();
        tape.lookups.push(CacheLookup { surface: CLEARCOAT, ..lookup(d_radiance, d_strength) });
        assert!(
            !CpuBackend::new(clearcoated_model(Extent::Bounded)).update_rest(&[tape], &learning()),
            "{d_radiance} {d_strength}"
        );
    }
}

/// Lengths in tinted glass teach its coefficients; one that overflowed does not, and is counted beside index samples.
#[test]
fn absorption_along_a_path_that_overflowed_teaches_nothing_and_is_counted() {
    let model = tinted_ball();
    let medium = &model.refraction.medium;
    let ray = Ray { origin: Vec3 { x: 0.1, y: -3.0, z: 0.05 }, direction: Vec3 { x: 0.0, y: 1.0, z: 0.0 } };
    let path = Tracer::new(medium, &model.field.domain, Options::default()).trace(&ray);
    let of = |d_whole: f32| {
        let samples = RaySamples { samples: &[], segments: &[] };
        let d_whole = [d_whole; 3];
        let ray = FilteredRay { medium, path: &path, samples, filtered: &[], mirrored: &[], d_whole };
        let mut tape = Tape::default();
        tape.absorption.resize(1, [0.0; 3]);
        tape.overflows = ray.absorb_vjp(&mut [], &mut tape.absorption, &mut LengthAdjoint::default());
        (tape.absorption[0], overflows(&learning(), &[tape]))
    };
    let (usual, none) = of(1.0);
    assert!(usual[0] > 0.0 && none == 0, "{usual:?} {none}");
    for value in [f32::NAN, f32::INFINITY] {
        let (nothing, counted) = of(value);
        assert_eq!(nothing, [0.0; 3]);
        assert!(counted > 0);
    }
}
