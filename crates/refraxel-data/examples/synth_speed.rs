//! Renders scenes and reports the tracer's speed: `synth_speed OUT SCENE...` writes the contact sheets of the scenes
//! (all, when none is named), times 150 views of 200² of `glass_ball` with 16 samples per pixel in memory, measures how
//! far the pictures of two seeds lie apart, and writes a whole dataset with the usual options to `OUT/glass_ball`.
#![allow(clippy::print_stdout)]

use refraxel_data::synth::{
    DatasetOptions, Sampling, SceneOptions, contact_sheet, render_dataset, scene, scene_list,
};
use refraxel_data::synth::{Elevations, SynthOptions, cameras, render_view, synthesize};
use refraxel_data::{Image, Pixels};
use std::ops::ControlFlow::Continue;
use std::time::Instant;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut words = std::env::args().skip(1);
    let out = words.next().ok_or("expected a folder and, optionally, names of scenes")?;
    let named: Vec<String> = words.collect();
    let names =
        scene_list().into_iter().map(|s| s.name).filter(|s| named.is_empty() || named.iter().any(|n| n == s));
    for name in names {
        let scene = scene(name, &SceneOptions::default())?;
        let start = Instant::now();
        let Image { width, height, pixels: Pixels::U8(bytes), .. } =
            contact_sheet(&scene, &cameras(scene.elevations, 5, 1, [200, 200]), &Sampling::default())
        else {
            continue;
        };
        image::save_buffer(format!("{out}/{name}.png"), &bytes, width, height, image::ColorType::Rgb8)?;
        println!("{name}: {:.2} s", start.elapsed().as_secs_f64());
    }
    let cost =
        render_dataset(&scene("glass_ball", &SceneOptions::default())?, &DatasetOptions::default()).cost;
    println!("{} camera rays, {} flights in {:.1} s", cost.samples, cost.tally.flights, cost.seconds);
    println!("{:.2} million camera rays/s", cost.rays_per_second() / 1e6);
    for (spp, detail_spp) in [(16, 0), (16, 64), (16, 144), (64, 0)] {
        println!("spp {spp}, detail {detail_spp}: {:.1} dB between two seeds", seeds_apart(spp, detail_spp)?);
    }
    let summary =
        synthesize(&SynthOptions::new("glass_ball", format!("{out}/glass_ball")), &|_| Continue(()))?;
    println!(
        "dataset: {} pictures in {:.1} s, {:.1} samples per pixel, {:.1e} of the energy lost",
        summary.rendered,
        summary.cost.seconds,
        summary.cost.samples as f64 / summary.rendered.max(1) as f64 / 4e4,
        summary.lost_energy
    );
    Ok(())
}

/// PSNR [dB] between 8-bit pictures of one view with different jitter.
fn seeds_apart(spp: u32, detail_spp: u32) -> Result<f64, Box<dyn std::error::Error>> {
    let scene = scene("glass_ball", &SceneOptions::default())?;
    let camera = &cameras(Elevations::UPPER, 1, 1, [200, 200])[0];
    let [a, b] = [1, 2].map(|seed| {
        let frame =
            render_view(&scene, camera, 0, &Sampling { spp, detail_spp, seed, ..Sampling::default() });
        frame.image()
    });
    let mse = (0..a.len())
        .flat_map(|p| (0..3).map(move |c| (p, c)))
        .map(|(p, c)| f64::from(a.rgba(p)[c] - b.rgba(p)[c]).powi(2));
    Ok(-10.0 * (mse.sum::<f64>() / (3 * a.len()) as f64).log10())
}
