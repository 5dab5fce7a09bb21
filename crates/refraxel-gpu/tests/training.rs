//! Whole runs on an adapter of this machine, with stages, pruning and saves: as good as those of the CPU, and resumed there.

use refraxel_core::{Camera, Vec3, vec3};
use refraxel_data::{Backdrop, Dataset, Image, MaskMeaning, Part, Photo, Pixels, PosedPhoto, Split};
use refraxel_gpu::{DeviceChoice, Gpu, GpuBackend};
use refraxel_train::model::{Model, Optimiser};
use refraxel_train::run::Run;
use refraxel_train::session::{Session, Setup, Stop, Until};
use refraxel_train::{CpuBackend, Options};

/// A ball before white, striped by height, photographed from the k-th place around it.
fn photograph(k: u32) -> PosedPhoto {
    let (turn, size) = (f64::from(k) * 2.4, 24);
    let eye = vec3(3.0 * turn.cos(), 3.0 * turn.sin(), f64::from(k) / 8.0 - 1.0);
    let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [size, size]);
    let colour = |p: u32| {
        let ray = camera.ray(f64::from(p % size) + 0.5, f64::from(p / size) + 0.5);
        let ray = ray.expect("a pixel of a camera without distortion");
        let nearest = ray.at(-ray.origin.dot(ray.direction));
        let depth = (0.49 - nearest.dot(nearest)).max(0.0).sqrt();
        let at = nearest - ray.direction * depth;
        if depth > 0.0 { [60, (128.0 + 150.0 * at.z) as u8, (128.0 + 150.0 * at.x) as u8] } else { [255; 3] }
    };
    let pixels = (0..size * size).flat_map(colour).collect();
    let image = Image { width: size, height: size, channels: 3, pixels: Pixels::U8(pixels) };
    let (name, photo) = (format!("{k}.png"), Photo::new(image, None));
    PosedPhoto { name, camera, photo, mask_meaning: MaskMeaning::Keep }
}

fn setup() -> Setup {
    let split = Split { train: (2..18).collect(), test: vec![0, 1], ..Split::default() };
    let photos = (0..18).map(photograph).collect();
    let data = Dataset::in_memory(photos, split, Backdrop::Color([1.0; 3])).expect("a dataset");
    let mut options = Options::default();
    for (key, value) in
        [("run.steps", "120"), ("run.batch", "512"), ("grid.resolution", "24"), ("field.sh_degree", "1")]
    {
        options.set(key, value).expect("an option");
    }
    Setup::new(data, options)
}

fn gpu() -> Gpu {
    Gpu::open(DeviceChoice::Adapter(0)).expect("an adapter").expect("not the CPU")
}

fn start(model: Model) -> GpuBackend {
    GpuBackend::new(gpu(), model).expect("a model that fits")
}

fn resume(model: Model, optimiser: Optimiser) -> GpuBackend {
    GpuBackend::resumed(gpu(), &model, &optimiser).expect("a model that fits")
}

/// PSNR of the held-out views at the end of a run [dB].
fn finish(mut session: Session) -> f64 {
    assert_eq!(session.run(Until::finished(), &mut |_| {}).expect("a run"), Stop::Finished);
    let scores = session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| {}).expect("scores").scores;
    scores.psnr.expect("a score")
}

/// A run to the middle, saved.
fn half(mut session: Session) -> Vec<u8> {
    assert_eq!(session.run(Until::step(60), &mut |_| {}).expect("a run"), Stop::Reached);
    let mut saved = Vec::new();
    session.write(&mut saved).expect("memory");
    saved
}

#[test]
#[ignore = "needs a Vulkan adapter"]
fn a_run_is_as_good_as_on_the_cpu_and_goes_on_there_and_back() {
    // Two runs that round otherwise part company, and meet again within this [dB].
    const TOL: f64 = 0.1;
    let watch = &mut |_| {};
    let cpu = finish(Session::start(setup(), CpuBackend::new, watch).expect("a session"));
    let gpu = finish(Session::start(setup(), start, watch).expect("a session"));
    assert!(cpu > 20.0 && (cpu - gpu).abs() < TOL, "{cpu:.3} dB on the CPU, {gpu:.3} dB on the GPU");
    let read = |saved: &[u8]| Run::read(saved).expect("a run");
    let from_gpu = half(Session::start(setup(), start, watch).expect("a session"));
    let on_cpu = Session::resume(setup(), read(&from_gpu), CpuBackend::resumed, watch).expect("a session");
    let from_cpu = half(Session::start(setup(), CpuBackend::new, watch).expect("a session"));
    let on_gpu = Session::resume(setup(), read(&from_cpu), resume, watch).expect("a session");
    for (there, psnr) in [("CPU", finish(on_cpu)), ("GPU", finish(on_gpu))] {
        assert!((cpu - psnr).abs() < TOL, "{psnr:.3} dB, resumed on the {there}, instead of {cpu:.3}");
    }
}
