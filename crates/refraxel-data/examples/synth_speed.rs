//! Renders scenes and reports the tracer's speed: `synth_speed OUT SCENE...` writes the contact sheets of the scenes
//! (all, when none is named) and then times 150 views of 200² of `glass_ball` with 16 samples per pixel.
#![allow(clippy::print_stdout)]

use refraxel_data::synth::{CameraSet, cameras};
use refraxel_data::synth::{
    DatasetOptions, Sampling, SceneOptions, contact_sheet, render_dataset, scene, scene_list,
};
use refraxel_data::{Image, Pixels};
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
            contact_sheet(&scene, &cameras(CameraSet::Upper, 5, 1, [200, 200]), &Sampling::default())
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
    Ok(())
}
