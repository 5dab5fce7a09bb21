//! Batches that are drawn on an adapter of this machine: the same as on the host, few numbers at a time.

use refraxel_core::{Camera, Extent, Vec3, vec3};
use refraxel_data::{Backdrop, Image, Mask, MaskMeaning, Photo, Pixels, View};
use refraxel_gpu::{DeviceChoice, Gpu, GpuBackend, Traffic};
use refraxel_train::Backend;
use refraxel_train::backend::conformance::drawn::{SCARCE, cases, change, gated_model};
use refraxel_train::backend::conformance::scenes::{batch, index_objective, objective, straight_model};
use refraxel_train::backend::{Batch, Objective};
use refraxel_train::model::Model;
use refraxel_train::rays::{Draw, RaySampler, Selection};

/// A device of its own, whose traffic is that of one test.
fn gpu() -> Gpu {
    Gpu::open(DeviceChoice::Adapter(0)).expect("an adapter").expect("not the CPU")
}

fn backend(gpu: Gpu, model: Model) -> GpuBackend {
    GpuBackend::new(gpu, model).expect("a model that fits")
}

/// One photograph of this size, a tenth of which shows something refractive.
fn large(size: [u32; 2], with_mask: bool) -> RaySampler {
    let [width, height] = size;
    let camera = Camera::look_at(vec3(3.0, 0.0, 0.4), Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, size);
    let view = View { mask_meaning: MaskMeaning::Refractive, ..View::of_file("a.png", camera) };
    let count = (width * height) as usize;
    let pixels = Pixels::U8((0..3 * count).map(|i| (i * 31 % 251) as u8).collect());
    let coverage = (0..count).map(|p| if p.is_multiple_of(10) { 255 } else { 0 }).collect();
    let mask = with_mask.then_some(Mask { width, height, coverage });
    let photo = Photo::new(Image { width, height, channels: 3, pixels }, mask);
    RaySampler::new(vec![view], vec![photo], Backdrop::Color([1.0; 3]), 3)
}

/// Where a batch differs from that of the host.
fn difference(got: &Batch, want: &Batch, is_exposed: bool) -> Option<String> {
    // WGSL divides to 2.5 ulp of 6e-8 and may fuse a sum; its powers, which change exposures of dark colours, err by 1e-5 of themselves.
    let colour = if is_exposed { 1e-5 } else { 5e-7 };
    // The host rounds once, from f64; here centre, focal length, rotation and root are f32.
    const DIRECTION: f32 = 5e-7;
    let apart = |a: [f32; 3], b: [f32; 3]| (0..3).fold(0.0_f32, |m, c| m.max((a[c] - b[c]).abs()));
    if got.rays.len() != want.rays.len() {
        return Some(format!("{} rays and {}", got.rays.len(), want.rays.len()));
    }
    let offset = got.offset.iter().zip(&want.offset).find(|(a, b)| a.to_bits() != b.to_bits());
    if let Some((a, b)) = offset {
        return Some(format!("an offset of {a:e}, on the host {b:e}"));
    }
    if got.behind != want.behind || got.beside != want.beside {
        return Some("the colours behind, or what lies beside masks".to_owned());
    }
    let differs = |k: &usize| {
        let (a, b) = (&got.rays[*k], &want.rays[*k]);
        a.origin != b.origin
            || apart(a.direction.to_array(), b.direction.to_array()) > DIRECTION
            || apart(got.target[*k], want.target[*k]) > colour
    };
    let first = (0..got.rays.len()).find(differs)?;
    let of = |b: &Batch| format!("{:?} {:?}", b.rays[first], b.target[first]);
    Some(format!("ray {first}: {}, on the host {}", of(got), of(want)))
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn the_device_draws_the_batches_of_the_host() {
    let mut gpu = backend(gpu(), straight_model(0, Extent::Bounded));
    for mut case in cases() {
        for number in [0, 7, u64::MAX / 4 + 3] {
            if number == 7 {
                change(&mut case);
            }
            let draw = case.draw(number);
            let (got, bends) = gpu.drawn(&draw).expect("a device without a fault").expect("a batch");
            let different = difference(&got, &draw.batch(), case.name == "exposures");
            assert_eq!(different, None, "{}, batch {number}", case.name);
            assert!(!bends.contains(&true));
        }
    }
}

#[test]
fn few_pixels_that_count_leave_rays_out() {
    let case = cases().into_iter().find(|c| c.name == SCARCE).expect("a case");
    let rays = case.draw(1).batch().rays.len();
    assert!(
        rays > 50 && rays < case.draw(1).size * 9 / 10,
        "{rays} rays: the claims above show nothing of it"
    );
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn the_device_finds_the_rays_that_bend() {
    let model = gated_model();
    let mut gpu = backend(gpu(), model.clone());
    for case in cases() {
        let draw = case.draw(2);
        let (got, bends) = gpu.drawn(&draw).expect("a device without a fault").expect("a batch");
        let want: Vec<bool> = draw.batch().rays.iter().map(|ray| model.refraction.admits(ray)).collect();
        // A point on the border of the gate may fall to its other side by rounding.
        let different = bends.iter().zip(&want).filter(|(a, b)| a != b).count();
        assert!(different * 200 <= got.rays.len(), "{}: {different} of {}", case.name, got.rays.len());
        let share = want.iter().filter(|b| **b).count() as f64 / want.len() as f64;
        assert!((0.01..0.9).contains(&share), "{}: {share} of the rays bend", case.name);
    }
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn photographs_are_cut_into_pools() {
    let sampler = large([640, 512], true);
    let mut gpu = backend(gpu().with_binding_limit(1 << 19), straight_model(0, Extent::Bounded));
    let draw = Draw { sampler: &sampler, number: 4, size: 2000, selection: Selection::Inside(0.5), reach: 0 };
    let (got, _) = gpu.drawn(&draw).expect("a device without a fault").expect("a batch");
    assert_eq!(difference(&got, &draw.batch(), false), None);
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn photographs_that_do_not_fit_are_drawn_from_on_the_host_and_that_is_said() {
    let (sampler, small) = (large([2048, 1100], true), large([64, 48], false));
    let mut gpu = backend(gpu().with_binding_limit(1 << 19), straight_model(0, Extent::Bounded));
    let draw = |sampler| Draw { sampler, number: 4, size: 100, selection: Selection::All, reach: 0 };
    assert!(gpu.submit_drawn(&draw(&sampler), &objective(), 0));
    let why = gpu.why_on_host().expect("a reason");
    assert!(why.contains("byte there, and 524288 are to be had"), "{why}");
    assert!(gpu.submit_drawn(&draw(&small), &objective(), 1));
    assert_eq!(gpu.why_on_host(), None);
    assert!(gpu.outcomes(true).iter().all(|o| o.finite && o.rays == 100));
    let around = Draw { selection: Selection::Around(1), ..draw(&small) };
    assert!(gpu.submit_drawn(&around, &objective(), 2) && gpu.why_on_host().is_some());
}

/// What steps send and read, after the first.
fn traffic(gpu: &mut GpuBackend, steps: u64, mut submit: impl FnMut(&mut GpuBackend, u64)) -> Traffic {
    submit(gpu, 0);
    let before = gpu.gpu().traffic();
    (1..=steps).for_each(|step| submit(gpu, step));
    gpu.gpu().traffic() - before
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_step_on_a_drawn_batch_sends_few_numbers_and_reads_none() {
    let (steps, case) = (20, cases().swap_remove(0));
    let mut gpu = backend(gpu(), straight_model(1, Extent::Bounded));
    let drawn = traffic(&mut gpu, steps, |gpu, k| assert!(gpu.submit_drawn(&case.draw(k), &objective(), k)));
    assert!(drawn.written <= 512 * steps && drawn.read == 0 && drawn.waits == 0, "{drawn:?}");
    let outcomes = gpu.outcomes(true);
    assert!(outcomes.len() as u64 == 1 + steps && outcomes.iter().all(|o| o.finite));
    let (sent, b) = (64 * 500 * steps, batch(500));
    let given = traffic(&mut gpu, steps, |gpu, k| gpu.submit(&b, &objective(), k));
    assert!(given.written >= sent, "{given:?}");
}

/// Paths are asked for once where as many dispatches suffice as before, and what the host moves is read once.
#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_step_of_bent_rays_waits_twice_or_thrice() {
    let (steps, case) = (8, cases().swap_remove(0));
    let mut gpu = backend(gpu(), gated_model());
    let o = Objective { index: Some(index_objective()), ..objective() };
    let all = traffic(&mut gpu, steps, |gpu, k| assert!(gpu.submit_drawn(&case.draw(k), &o, k)));
    assert!(all.waits >= 2 * steps && all.waits <= 3 * steps, "{all:?}");
}
