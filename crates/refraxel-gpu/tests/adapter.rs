//! The GPU backend on an adapter of this machine, be it a software one: the claims of the conformance suite, and what
//! is its own affair.

use half::f16;
use refraxel_core::radiance::Pixel;
use refraxel_core::{Background, Extent, Integrator, Ray, ShDegree, vec3};
use refraxel_gpu::{AdapterKind, DeviceChoice, Gpu, GpuBackend, GpuError, GpuRenderer, Unsupported};
use refraxel_train::backend::conformance::bent::{bent_model, graded_body_model, sharp_model};
use refraxel_train::backend::conformance::scenes::{batch, index_objective, objective, straight_model};
use refraxel_train::backend::conformance::{Suite, Tolerances, clearcoated as coated, mirrored as mirroring};
use refraxel_train::backend::{
    AbsorptionObjective, Batch, BatchGradient, Layers, Marching, Objective, ReflectionObjective, step,
};
use refraxel_train::cancel::Cancel;
use refraxel_train::model::{MirrorSource, ProbeLayout, Reflection};
use refraxel_train::{Backend, CpuBackend, Model};
use std::sync::OnceLock;
use std::time::Duration;

/// The first adapter.
fn gpu() -> Gpu {
    static GPU: OnceLock<Gpu> = OnceLock::new();
    let open = || Gpu::open(DeviceChoice::Adapter(0)).expect("an adapter").expect("not the CPU");
    GPU.get_or_init(open).clone()
}

fn make(model: Model) -> GpuBackend {
    GpuBackend::new(gpu(), model).expect("a model that fits")
}

refraxel_train::conformance_tests! {
    Suite { make, tolerances: Tolerances::SINGLE_PRECISION }, ignore = "needs a Vulkan adapter"
}

/// Everything that a straight scene minimises.
fn all_priors() -> Objective {
    let (tv_density, tv_colour, tv_period) = (0.02, 0.01, 2);
    let priors = Objective { sample_colour: 0.1, full_distance: 3.0, ..objective() };
    Objective { tv_density, tv_colour, tv_period, rate_view: 0.5, ..priors }
}

/// Largest difference of two arrays.
fn apart(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).fold(0.0, |m, (a, b)| m.max((a - b).abs()))
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn pictures_are_those_of_the_cpu() {
    // Both round in f32: eps 6e-8 × about 100 samples, with a margin of 10.
    const TOL: f32 = 6e-5;
    let near =
        Marching { near: 2.5, min_optical_depth: 1e-3, min_transmittance: 1e-2, ..Marching::exhaustive(0.5) };
    for extent in [Extent::Bounded, Extent::Contracted] {
        let model = straight_model(2, extent);
        let (mut cpu, mut gpu, rays) = (CpuBackend::new(model.clone()), make(model), batch(500).rays);
        for marching in [Marching::exhaustive(0.5), near] {
            cpu.refresh_occupancy(&marching);
            gpu.refresh_occupancy(&marching);
            assert_eq!(cpu.snapshot().optimiser.occupied, gpu.snapshot().optimiser.occupied);
            let want = cpu.render(&rays, &marching, Layers::All);
            let got = gpu.render(&rays, &marching, Layers::All);
            let different = want.iter().zip(&got).filter(|(a, b)| {
                apart(&a.colour, &b.colour) > TOL
                    || (a.transmittance - b.transmittance).abs() > TOL
                    || (a.depth - b.depth).abs() > 10.0 * TOL
            });
            // A sample may fall to the other side of a face, or of a cut-off, by rounding.
            assert!(different.count() <= rays.len() / 50, "{extent:?}");
        }
    }
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn the_first_steps_are_those_of_the_cpu() {
    let mut model = straight_model(1, Extent::Bounded);
    // The noise of this field fills the padding, too, where a model has zeros.
    let degree = model.field.degree;
    model.field.colour.chunks_mut(degree.stride()).for_each(|voxel| voxel[3 * degree.basis()..].fill(0.0));
    let (mut cpu, mut gpu, b) = (CpuBackend::new(model.clone()), make(model), batch(400));
    for k in 0..3 {
        let (want, got) = (step(&mut cpu, &b, &all_priors(), k), step(&mut gpu, &b, &all_priors(), k));
        let samples = want.samples.abs_diff(got.samples);
        assert!(samples <= want.samples / 1000, "{} and {} samples", want.samples, got.samples);
        assert!((want.squared_error - got.squared_error).abs() < 1e-3 * want.squared_error);
    }
    let (want, got) = (cpu.snapshot(), gpu.snapshot());
    // A first step is as long as its rate, whatever the gradient: where it is 0 but for rounding, signs may differ.
    let far = |a: &[f32], b: &[f32], tol: f32| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > tol).count();
    let density = far(&want.model.field.density, &got.model.field.density, 1e-2);
    let colour = far(&want.model.field.colour, &got.model.field.colour, 1e-3);
    assert!(density * 100 < want.model.field.density.len(), "{density} densities differ");
    assert!(colour * 100 < want.model.field.colour.len(), "{colour} coefficients differ");
    let (Background::Environment(a), Background::Environment(b)) =
        (&want.model.background, &got.model.background)
    else {
        unreachable!("a panorama")
    };
    assert!(apart(a.texels.as_flattened(), b.texels.as_flattened()) < 1e-3);
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn the_same_steps_give_the_same_bits_whatever_the_order_of_rays() {
    let model = straight_model(2, Extent::Bounded);
    let mut turned = batch(300);
    turned.rays.reverse();
    turned.target.reverse();
    turned.offset.reverse();
    let mut ends = Vec::new();
    for b in [batch(300), batch(300), turned] {
        let mut gpu = make(model.clone());
        (0..4).for_each(|k| gpu.submit(&b, &all_priors(), k));
        assert!(gpu.outcomes(true).iter().all(|o| o.finite));
        let snapshot = gpu.snapshot();
        ends.push((snapshot.model.field.density.clone(), snapshot.model.field.colour.clone()));
    }
    assert!(ends[0] == ends[1] && ends[0] == ends[2]);
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_field_cut_into_pools_learns_the_same_bits() {
    let model = straight_model(2, Extent::Bounded);
    let small = gpu().with_binding_limit(1 << 19);
    let pools = |gpu: Gpu| GpuBackend::new(gpu, model.clone()).expect("a model that fits");
    let (mut one, mut many, b) = (make(model.clone()), pools(small), batch(200));
    for k in 0..2 {
        assert_eq!(step(&mut one, &b, &all_priors(), k), step(&mut many, &b, &all_priors(), k));
    }
    let (one, many) = (one.snapshot(), many.snapshot());
    assert!(one.model.field.colour == many.model.field.colour);
    assert!(one.model.field.density == many.model.field.density);
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn the_background_may_come_with_the_rays() {
    let model = straight_model(0, Extent::Bounded);
    let (cpu, gpu, mut b) = (CpuBackend::new(model.clone()), make(model), batch(100));
    b.behind = b.target.iter().map(|t| t.map(|v| 1.0 - v)).collect();
    let (want, got) = (cpu.gradient(&b, &objective()), gpu.gradient(&b, &objective()));
    assert!((want.outcome.squared_error - got.outcome.squared_error).abs() < 1e-3);
    assert!(got.background.as_flattened().iter().all(|&d| d == 0.0));
    assert!(apart(&want.field.density, &got.field.density) < 1e-4);
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn rays_that_miss_or_are_no_numbers_end() {
    let gpu = make(straight_model(1, Extent::Bounded));
    let beside = Ray { origin: vec3(9.0, 0.0, 0.0), direction: vec3(0.0, 1.0, 0.0) };
    let wrong = Ray { origin: vec3(f32::NAN, 0.0, 0.0), direction: vec3(f32::NAN, 0.0, 1.0) };
    let seen = gpu.render(&[beside, wrong], &Marching::exhaustive(0.5), Layers::All);
    assert_eq!(seen[0].transmittance, 1.0);
}

/// What is not there yet is an error before the work, not another picture.
#[test]
fn models_with_what_is_not_there_yet_are_refused() {
    assert_eq!(GpuBackend::supports(&straight_model(1, Extent::Contracted)), Ok(()));
    assert_eq!(GpuBackend::supports(&sharp_model(Extent::Bounded)), Ok(()));
    let mut euler = bent_model(Extent::Bounded);
    euler.refraction.optics.integrator = Integrator::ExplicitEuler;
    assert_eq!(GpuBackend::supports(&euler), Err(Unsupported::Integrator));
    assert!(Unsupported::Integrator.to_string().contains("--device cpu"));
    assert_eq!(GpuBackend::supports(&mirroring::sharp_ball()), Ok(()));
    assert_eq!(GpuBackend::supports(&coated::clearcoated_model(Extent::Bounded)), Ok(()));
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_refusal_is_no_fault_of_the_device() {
    let mut euler = bent_model(Extent::Bounded);
    euler.refraction.optics.integrator = Integrator::ExplicitEuler;
    let refused = GpuBackend::new(gpu(), euler).map(|_| ());
    assert_eq!(refused, Err(GpuError::Unsupported(Unsupported::Integrator)));
    assert_eq!(gpu().fault(), None);
}

#[test]
#[ignore = "needs a software adapter as the first one: hardware counts no steps"]
fn a_software_adapter_with_a_fault_says_so_and_learns_nothing() {
    let gpu = own_device();
    assert_eq!(gpu.adapter().kind, AdapterKind::Software);
    let mut backend = GpuBackend::new(gpu, straight_model(0, Extent::Bounded)).expect("a model that fits");
    let endless = Objective { marching: Marching::exhaustive(1e-3), ..objective() };
    assert_eq!(backend.fault(), None);
    backend.submit(&batch(10), &endless, 7);
    let outcomes = backend.outcomes(true);
    assert!(outcomes.len() == 1 && outcomes[0].step == 7 && !outcomes[0].finite);
    let fault = backend.fault().expect("a fault");
    assert!(fault.contains("65535 iterations") && fault.contains("--device cpu"), "{fault}");
}

/// What several steps on straight and on bent rays make of the voxels.
fn learned(gpu: &Gpu) -> Vec<(Vec<f32>, Vec<f32>)> {
    let models = [
        (straight_model(1, Extent::Bounded), all_priors()),
        (sharp_model(Extent::Bounded), all_that_bends()),
    ];
    let learned = models.map(|(model, objective)| {
        let mut backend = GpuBackend::new(gpu.clone(), model).expect("a model that fits");
        (0..2).for_each(|k| backend.submit(&batch(200), &objective, k));
        assert!(backend.outcomes(true).iter().all(|o| o.finite), "{:?}", backend.fault());
        let field = &backend.snapshot().model.field;
        (field.density.to_vec(), field.colour.to_vec())
    });
    learned.to_vec()
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn dispatches_of_more_workgroups_than_a_dimension_takes_learn_the_same_bits() {
    assert!(learned(&gpu()) == learned(&gpu().with_workgroup_limit(3)));
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn what_does_not_fit_is_refused_before_the_work_and_is_no_fault() {
    let model = straight_model(1, Extent::Bounded);
    let (degree, voxels) = (model.field.degree, model.field.map.voxels());
    let binds = |bytes: usize| gpu().with_binding_limit(bytes as u64);
    for (gpu, what) in [
        (binds(8 * voxels - 1), "the gradient of density"),
        (gpu().with_memory(100 * voxels as u64), "the model needs"),
    ] {
        let refused = GpuBackend::new(gpu.clone(), model.clone()).map(drop).unwrap_err().to_string();
        assert!(refused.contains(what) && refused.contains("--device cpu"), "{refused}");
        let expected = GpuBackend::fits(&gpu, degree, voxels, false).unwrap_err().to_string();
        assert_eq!((refused, gpu.fault()), (expected, None));
    }
    assert_eq!(GpuBackend::fits(&binds(16 * voxels), degree, voxels, false), Ok(()));
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_batch_that_no_binding_takes_is_a_fault_that_says_so() {
    let small = own_device().with_binding_limit(1 << 19);
    let mut backend = GpuBackend::new(small, straight_model(1, Extent::Bounded)).expect("a model that fits");
    backend.submit(&batch(20_000), &objective(), 0);
    assert!(backend.outcomes(true).iter().all(|o| !o.finite));
    let fault = backend.fault().expect("a fault");
    assert!(fault.contains("`lessons`") && fault.contains("run.batch"), "{fault}");
}

/// A device of its own: a fault stays.
fn own_device() -> Gpu {
    Gpu::open(DeviceChoice::Adapter(0)).expect("an adapter").expect("not the CPU")
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_device_that_is_lost_or_silent_says_so_and_learns_nothing() {
    let lost = own_device();
    let silent = own_device().with_patience(Duration::from_nanos(1));
    // A wait may begin after the device has ended a step: then nothing was late.
    for (gpu, what, tries) in [(lost, "was lost", 1), (silent, "has not answered", 100)] {
        let mut backend =
            GpuBackend::new(gpu.clone(), straight_model(1, Extent::Bounded)).expect("a model that fits");
        if what == "was lost" {
            gpu.lose();
        }
        let outcome = (0..tries).find_map(|step| {
            backend.submit(&batch(2000), &objective(), step);
            let outcomes = backend.outcomes(true);
            assert_eq!(outcomes.len(), 1);
            backend.fault().is_some().then_some(outcomes[0])
        });
        assert!(!outcome.expect("a fault").finite);
        let fault = backend.fault().expect("a fault");
        assert!(fault.contains(what) && fault.contains("--device cpu"), "{fault}");
    }
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn kernels_are_timed_where_the_adapter_has_a_clock() {
    let (gpu, b) = (own_device(), batch(500));
    let mut backend =
        GpuBackend::new(gpu.clone(), straight_model(1, Extent::Bounded)).expect("a model that fits");
    let has_clock = gpu.start_clock();
    (0..3).for_each(|k| backend.submit(&b, &objective(), k));
    let samples = backend.outcomes(true)[0].samples;
    let times = gpu.stop_clock().expect("times");
    let of = |kernel: &str| times.iter().find(|t| t.kernel == kernel).map(|t| (t.passes, t.seconds > 0.0));
    let expected = |passes| has_clock.then_some((passes, true));
    assert_eq!((of("render"), of("learn"), of("occupancy")), (expected(3), expected(3), expected(1)));
    assert!(gpu.stop_clock().expect("no times").is_empty());
    assert!(gpu.copy_rate().expect("a rate") > 1e8);
    // A sample touches eight voxels, and voxels are touched by many.
    let moved = backend.moved(&b, &objective()).expect("voxels");
    assert!((1..8 * samples).contains(&moved), "{moved} of {samples} samples");
    assert!(backend.bytes_of("update", 0, moved) > backend.bytes_of("update", 0, 0));
    assert_eq!(backend.bytes_of("render", 10, 0), Some(10 * 8 * (4 + 48)));
}

/// All bodies absorb, each otherwise.
fn tinted(mut model: Model) -> Model {
    for region in 0..model.refraction.medium.regions().len() {
        let tint = [0.3, 1.6, 3.0].map(|a| a / (1.0 + region as f32));
        model.refraction.medium.region_mut(region).set_absorption(tint);
    }
    model
}

/// What this model shows where surfaces mirror noise, and opaque things have a clearcoat.
fn glossy(model: Model) -> Model {
    let layout = ProbeLayout { longest: 4, degree: ShDegree::MAX };
    let mut reflection = Reflection::of(&model.refraction, MirrorSource::Learned, &layout);
    let mut k = 0;
    let mut noise = || {
        k += 1;
        0.15 * (12.9898 * k as f32).sin()
    };
    for mirror in &mut reflection.mirrors {
        mirror.strength = 0.7;
        let caches = mirror.outer.coefficients.iter_mut().chain(&mut mirror.inner.coefficients);
        caches.for_each(|c| *c = noise());
    }
    Model { reflection, clearcoat: coated::clearcoated_model(Extent::Bounded).clearcoat, ..model }
}

/// Everything that learns where rays bend and are mirrored.
fn all_that_bends() -> Objective {
    let reflection = ReflectionObjective { rate: 0.01, rate_strength: 0.01, rate_clearcoat: 0.01 };
    Objective {
        index: Some(index_objective()),
        reflection: Some(reflection),
        absorption: Some(AbsorptionObjective { rate: 0.01 }),
        bent_weight: 0.3,
        ..all_priors()
    }
}

/// Largest difference of two arrays, relative to the largest entry.
fn relative(want: &[f32], got: &[f32]) -> f32 {
    apart(want, got) / want.iter().fold(f32::MIN_POSITIVE, |m, v| m.max(v.abs()))
}

/// Everything that a batch gives, one name each.
fn parts(d: &BatchGradient) -> Vec<(String, Vec<f32>)> {
    let mut all = vec![
        ("density".to_owned(), d.field.density.to_vec()),
        ("colour".to_owned(), d.field.colour.to_vec()),
        ("texels".to_owned(), d.background.as_flattened().to_vec()),
        ("absorption".to_owned(), d.absorption.as_flattened().iter().map(|a| *a as f32).collect()),
        ("origins".to_owned(), d.rays.iter().flat_map(|r| r.origin.to_array()).collect()),
        ("directions".to_owned(), d.rays.iter().flat_map(|r| r.direction.to_array()).collect()),
    ];
    for (name, arrays) in [("index", &d.medium.index), ("surface", &d.medium.level_set)] {
        all.extend(arrays.iter().enumerate().map(|(k, a)| (format!("{name} {k}"), a.clone())));
    }
    for (k, mirror) in d.reflection.iter().enumerate() {
        let strength = vec![mirror.strength as f32];
        let of_mirror = [("strength", &strength), ("outer", &mirror.outer), ("inner", &mirror.inner)];
        all.extend(of_mirror.map(|(name, a)| (format!("{name} {k}"), a.clone())));
    }
    if let Some(coat) = &d.clearcoat {
        all.extend(
            [("strength of the clearcoat", &coat.strength), ("its light", &coat.radiance)]
                .map(|(name, a)| (name.to_owned(), a.clone())),
        );
    }
    all
}

/// The rays of a batch that see the same on both devices, and meet few surfaces: where one grazes a surface, rounding decides between
/// two paths, and every further surface amplifies what rounding does.
fn agreed(cpu: &CpuBackend, gpu: &GpuBackend, b: &Batch) -> Batch {
    const TOL: f32 = 1e-4; // eps 6e-8 × about 100 segments × a lever arm of 20
    const EVENTS: usize = 6; // in and out of three bodies
    let tracer = cpu.medium().tracer(cpu.domain(), 0.0);
    let [want, got] = [cpu.ray_gradients(b, &objective()), gpu.ray_gradients(b, &objective())];
    let same = |k: &usize| apart(&want[*k].residual, &got[*k].residual) < TOL;
    assert!((0..b.rays.len()).filter(same).count() * 20 >= b.rays.len() * 19, "few rays agree");
    let few = |k: &usize| tracer.trace(&b.rays[*k]).events().count() <= EVENTS;
    let mut out = Batch::default();
    for k in (0..b.rays.len()).filter(same).filter(few) {
        out.rays.push(b.rays[k]);
        out.target.push(b.target[k]);
        out.offset.push(b.offset[k]);
    }
    assert!(out.rays.len() * 10 >= b.rays.len() * 7, "{} of {} rays are left", out.rays.len(), b.rays.len());
    out
}

/// dLoss/d(everything) through tinted bodies, with mirrors and a clearcoat and without. The conformance suite has absorption only with
/// mirrors, and no model with both.
#[test]
#[ignore = "needs a Vulkan adapter"]
fn gradients_of_tinted_bodies_are_those_of_the_cpu() {
    let tolerances = Tolerances::SINGLE_PRECISION;
    let bodies = [graded_body_model, sharp_model, bent_model].map(|model| tinted(model(Extent::Bounded)));
    for model in bodies.clone().into_iter().chain(bodies.map(glossy)) {
        let (cpu, gpu) = (CpuBackend::new(model.clone()), make(model));
        let b = agreed(&cpu, &gpu, &batch(200));
        let (want, got) = (cpu.gradient(&b, &all_that_bends()), gpu.gradient(&b, &all_that_bends()));
        assert!((want.outcome.squared_error / got.outcome.squared_error - 1.0).abs() < tolerances.ray);
        assert_eq!(want.outcome.overflows, got.outcome.overflows);
        for ((name, want), (_, got)) in parts(&want).iter().zip(&parts(&got)) {
            let error = relative(want, got);
            assert!(f64::from(error) < tolerances.index, "{name}: {error}");
        }
    }
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn the_first_bent_steps_are_those_of_the_cpu() {
    // Rates of the index and of surfaces: a step is about as long, whatever the gradient.
    const TOL: f32 = 2e-3;
    let body = tinted(sharp_model(Extent::Bounded));
    for (model, o) in [(body.clone(), all_that_bends()), (glossy(body), all_that_bends())] {
        let (mut cpu, mut gpu) = (CpuBackend::new(model.clone()), make(model));
        let b = agreed(&cpu, &gpu, &batch(300));
        for k in 0..3 {
            let (want, got) = (step(&mut cpu, &b, &o, k), step(&mut gpu, &b, &o, k));
            let error = (want.squared_error / got.squared_error - 1.0).abs();
            assert!(
                error < 5e-3,
                "{} and {} in step {k} ({:?})",
                want.squared_error,
                got.squared_error,
                gpu.fault()
            );
            assert!(want.samples.abs_diff(got.samples) <= want.samples / 200);
        }
        let (want, got) = (cpu.snapshot(), gpu.snapshot());
        for (want, got) in want.model.reflection.mirrors.iter().zip(&got.model.reflection.mirrors) {
            assert!((want.strength - got.strength).abs() < TOL);
            assert!(apart(&want.outer.coefficients, &got.outer.coefficients) < 5.0 * TOL);
            assert!(apart(&want.inner.coefficients, &got.inner.coefficients) < 5.0 * TOL);
        }
        let regions = want.model.refraction.medium.regions().iter();
        for (want, got) in regions.zip(got.model.refraction.medium.regions()) {
            let far = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| (*a - *b).abs() > TOL).count();
            assert!(far(want.coefficients(), got.coefficients()) * 50 <= want.coefficients().len());
            let level = |g: &refraxel_core::IndexGrid<f32>| g.level_set().map(|l| l.coefficients().to_vec());
            if let Some((want, got)) = level(want).zip(level(got)) {
                assert!(far(&want, &got) * 50 <= want.len());
            }
            assert!(apart(&want.absorption(), &got.absorption()) < TOL);
        }
        let moments = want.optimiser.index.iter().zip(&got.optimiser.index);
        assert!(moments.clone().all(|(a, b)| a.index.steps == b.index.steps));
        assert!(moments.clone().all(|(a, b)| a.surface.steps == b.surface.steps));
    }
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn bent_steps_give_the_same_bits_whatever_the_order_and_the_portions_of_rays_and_paths() {
    for model in [sharp_model(Extent::Bounded), mirroring::soft_ball()] {
        gives_the_same_bits(&glossy(tinted(model)));
    }
}

fn gives_the_same_bits(model: &Model) {
    let mut turned = batch(300);
    turned.rays.reverse();
    turned.target.reverse();
    turned.offset.reverse();
    // Room for the paths of forty rays.
    let small = gpu().with_binding_limit(1 << 20);
    let [few, many] = [3, 32].map(|segments| gpu().with_replay(segments));
    let mut ends = Vec::new();
    for (gpu, b) in
        [(gpu(), batch(300)), (gpu(), turned), (small, batch(300)), (few, batch(300)), (many, batch(300))]
    {
        let mut gpu = GpuBackend::new(gpu, model.clone()).expect("a model that fits");
        (0..3).for_each(|k| gpu.submit(&b, &all_that_bends(), k));
        let outcomes = gpu.outcomes(true);
        assert!(outcomes.iter().all(|o| o.finite));
        let snapshot = gpu.snapshot();
        let bodies: Vec<f32> = (snapshot.model.refraction.medium.regions().iter())
            .flat_map(|r| {
                let surface = r.level_set().map_or(&[][..], |l| l.coefficients());
                [r.coefficients(), surface, &r.absorption()].concat()
            })
            .collect();
        ends.push((
            snapshot.model.field.density.clone(),
            snapshot.model.field.colour.clone(),
            bodies,
            snapshot.model.reflection.clone(),
            snapshot.model.clearcoat.clone(),
            outcomes,
        ));
    }
    assert!(ends.iter().all(|end| *end == ends[0]));
}

/// Rays that are mirrored more often than there is room for at first.
#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_path_may_meet_any_number_of_surfaces_that_mirror() {
    const ROOM: usize = 4;
    let model = glossy(sharp_model(Extent::Bounded));
    let cpu = CpuBackend::new(model.clone());
    let tracer = cpu.medium().tracer(cpu.domain(), 0.0);
    let surfaces = |ray: &Ray<f32>| {
        let mut found = Vec::new();
        tracer.partial_reflections(&tracer.trace(ray), &mut found);
        found.len()
    };
    let (rays, marching) = (batch(300).rays, objective().marching);
    let often: Vec<Ray<f32>> = rays.into_iter().filter(|ray| surfaces(ray) > ROOM).collect();
    assert!(often.len() > 10, "{} rays", often.len());
    let [want, got] = [&cpu as &dyn Backend, &make(model) as &dyn Backend]
        .map(|backend| backend.render(&often, &marching, Layers::All));
    let different = want.iter().zip(&got).filter(|(a, b)| apart(&a.colour, &b.colour) > 1e-3).count();
    assert!(different * 10 <= often.len(), "{different} of {} rays differ", often.len());
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn peak_weights_along_bent_rays_are_those_of_the_cpu() {
    let model = sharp_model(Extent::Bounded);
    let (cpu, gpu, rays) = (CpuBackend::new(model.clone()), make(model), batch(200).rays);
    let [want, got] = [&cpu as &dyn Backend, &gpu as &dyn Backend].map(|backend| {
        backend.peak_weights(&rays, &Marching::exhaustive(0.5), &Cancel::new()).expect("not cancelled")
    });
    let different = want.iter().zip(&got).filter(|(a, b)| (*a - *b).abs() > 1e-3).count();
    assert!(different * 200 <= want.len() && want.iter().any(|w| *w > 0.1), "{different} differ");
}

/// llvmpipe leaves loops without a word; the kernels find out.
#[test]
#[ignore = "needs a Vulkan adapter"]
fn paths_that_a_software_adapter_leaves_are_told() {
    let gpu = own_device();
    if gpu.adapter().kind != AdapterKind::Software {
        return; // hardware counts no steps
    }
    let gpu = gpu.with_replay(2048); // whole paths
    let mut model = bent_model(Extent::Bounded);
    model.refraction.optics.step = 0.02;
    let mut backend = GpuBackend::new(gpu, model).expect("a model that fits");
    backend.submit(&batch(50), &Objective { index: Some(index_objective()), ..objective() }, 0);
    assert!(backend.outcomes(true).iter().all(|o| !o.finite));
    let fault = backend.fault().expect("a fault");
    assert!(fault.contains("65535 iterations") && fault.contains("path"), "{fault}");
}

fn shown(model: Model, rays: &[Ray<f32>], marching: &Marching) -> Vec<Pixel<f32>> {
    let renderer = GpuRenderer::new(gpu(), &model, marching).expect("a model that can be shown");
    renderer.render(rays, Layers::All).expect("a device without a fault")
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_model_that_is_shown_looks_as_on_the_cpu() {
    // Both trace in f32, and round otherwise where a ray grazes a surface: eps 6e-8 × a lever arm of 1e4 there.
    const TOL: f32 = 1e-3;
    let marching = Marching { min_optical_depth: 1e-3, min_transmittance: 1e-3, ..Marching::exhaustive(0.5) };
    for model in [
        straight_model(2, Extent::Bounded),
        bent_model(Extent::Contracted),
        sharp_model(Extent::Bounded),
        tinted(graded_body_model(Extent::Bounded)),
        glossy(bent_model(Extent::Bounded)),
    ] {
        let (mut cpu, rays) = (CpuBackend::new(model.clone()), batch(400).rays);
        cpu.refresh_occupancy(&marching);
        let want = cpu.render(&rays, &marching, Layers::All);
        let got = shown(model, &rays, &marching);
        let different = want.iter().zip(&got).filter(|(a, b)| apart(&a.colour, &b.colour) > TOL).count();
        assert!(different <= rays.len() / 50, "{different} rays differ");
    }
}

/// What is shown is held in halves, and so are the checkpoints of finished runs.
#[test]
#[ignore = "needs a Vulkan adapter"]
fn colours_of_a_finished_run_take_half_the_memory_and_are_shown_to_the_bit() {
    let (marching, rays) = (Marching::exhaustive(0.5), batch(400).rays);
    let mut model = straight_model(2, Extent::Bounded);
    model.field.colour.iter_mut().for_each(|c| *c = f16::from_f32(*c).to_f32());
    let (learning, showing) = (own_device(), own_device());
    let renderer = GpuRenderer::new(showing.clone(), &model, &marching).expect("a model that can be shown");
    let mut backend = GpuBackend::new(learning.clone(), model.clone()).expect("a model that fits");
    backend.refresh_occupancy(&marching);
    // What learns has two moments a voxel besides.
    let voxels = model.field.map.voxels() as u64;
    let [most, least] = [&learning, &showing].map(|gpu| gpu.traffic().written / voxels);
    assert_eq!(most - 8, least + 64, "bytes of a voxel: {most} and {least}");
    let (want, got) = (backend.render(&rays, &marching, Layers::All), renderer.render(&rays, Layers::All));
    let bits = |pixels: &[Pixel<f32>]| -> Vec<[u32; 3]> {
        pixels.iter().map(|p| p.colour.map(f32::to_bits)).collect()
    };
    assert!(bits(&want) == bits(&got.expect("a device without a fault")));
}
