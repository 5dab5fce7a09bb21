//! Trains on arrays in memory, watches, stops, goes on, scores and renders:
//! `cargo run --release -p refraxel-train --example session`

#![allow(clippy::print_stdout)] // an example talks

use refraxel_core::{Camera, Ray, Vec3, vec3};
use refraxel_data::{Backdrop, Dataset, Image, MaskMeaning, Part, Photo, Pixels, PosedPhoto, Split};
use refraxel_train::events::Event;
use refraxel_train::run::Run;
use refraxel_train::session::{Session, Setup, Stop, Until};
use refraxel_train::{CpuBackend, Options};
use std::error::Error;

/// A ball before white, coloured by its normal, photographed from the k-th place around it.
fn photograph(k: u32) -> PosedPhoto {
    let (turn, size) = (f64::from(k) * 2.4, 48);
    let eye = vec3(3.0 * turn.cos(), 3.0 * turn.sin(), f64::from(k) / 10.0 - 1.0);
    let camera = Camera::look_at(eye, Vec3::zero(), vec3(0.0, 0.0, 1.0), 0.7, [size, size]);
    let colour = |ray: Ray<f64>| {
        let nearest = ray.at(-ray.origin.dot(ray.direction));
        let depth = (0.49 - nearest.dot(nearest)).max(0.0).sqrt();
        let normal = (nearest - ray.direction * depth).normalized();
        if depth > 0.0 { (normal * 127.0 + Vec3::splat(128.0)).to_array().map(|c| c as u8) } else { [255; 3] }
    };
    let at = |p: u32| camera.ray(f64::from(p % size) + 0.5, f64::from(p / size) + 0.5);
    let pixels = (0..size * size).flat_map(|p| at(p).map_or([255; 3], colour)).collect();
    let image = Image { width: size, height: size, channels: 3, pixels: Pixels::U8(pixels) };
    let (name, photo) = (format!("{k}.png"), Photo::new(image, None));
    PosedPhoto { name, camera, photo, mask_meaning: MaskMeaning::Keep }
}

fn main() -> Result<(), Box<dyn Error>> {
    let split = Split { train: (2..22).collect(), test: vec![0, 1], ..Split::default() };
    let data = Dataset::in_memory((0..22).map(photograph).collect(), split, Backdrop::Color([1.0; 3]))?;
    let mut options = Options::default();
    for (key, value) in [("run.steps", "200"), ("run.batch", "1024"), ("grid.resolution", "48")] {
        options.set(key, value)?;
    }
    let setup = || Setup::new(data.clone(), options.clone());
    let mut session = Session::start(setup(), CpuBackend::new, &mut |_| {})?;
    let handle = session.handle(); // any thread may hold it
    let stop = session.run(Until::finished(), &mut |event| match event {
        Event::Record(r) if r.step >= 100 => handle.cancel(),
        Event::Record(r) => println!("step {}: {:.1} dB", r.step, r.train_psnr),
        other => println!("{other:?}"),
    })?;
    assert_eq!((stop, session.state().step), (Stop::Cancelled, 100));
    let mut saved = Vec::new();
    session.write(&mut saved)?;
    let mut session = Session::resume(setup(), Run::read(&saved[..])?, CpuBackend::resumed, &mut |_| {})?;
    assert_eq!(session.run(Until::finished(), &mut |_| {})?, Stop::Finished);
    let scores = session.evaluate(Part::Test, &mut |_| {}, &mut |_, _| {})?.scores;
    let view = session.render(&data.views[0].camera)?;
    println!("held out: {:.1} dB; a view of {} x {}", scores.psnr.unwrap_or(0.0), view.width, view.height);
    assert!(scores.psnr.is_some_and(|psnr| psnr > 25.0), "{scores:?}");
    Ok(())
}
