//! Copies a dataset and damages its masks, to see how well training copes with rough silhouettes:
//!
//! ```text
//! cargo run --release -p refraxel-data --example rough_masks -- FROM TO [erode=3] [dilate=3] [missing=0.1] [swap=0.05] [seed=0]
//! ```
//!
//! The dataset has the layout of NeRF-synthetic with masks in `masks/SPLIT/*.png`. `erode` and `dilate` [pixel] shrink and
//! grow every mask; `missing` is the share of the training masks that become empty, `swap` the share that are exchanged
//! with that of another view. Only training masks are emptied and exchanged. The same seed damages the same views; their
//! names are printed.
#![allow(clippy::print_stdout)]

use image::{GrayImage, Luma};
use refraxel_data::photographs::stored_pixels;
use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

/// The split that is learned from.
const LEARNED: &str = "train";

/// What is done to the masks.
#[derive(Default)]
struct Damage {
    erode: i32,
    dilate: i32,
    missing: f64,
    swap: f64,
    seed: u64,
}

impl Damage {
    fn parsed(words: &[String]) -> Result<Self, String> {
        let mut damage = Self::default();
        for word in words {
            let (key, value) = word.split_once('=').ok_or(format!("`{word}`: expected key=value"))?;
            let bad = |e: &dyn std::fmt::Display| format!("`{key}`: `{value}` is no number ({e})");
            match key {
                "erode" => damage.erode = value.parse().map_err(|e| bad(&e))?,
                "dilate" => damage.dilate = value.parse().map_err(|e| bad(&e))?,
                "missing" => damage.missing = value.parse().map_err(|e| bad(&e))?,
                "swap" => damage.swap = value.parse().map_err(|e| bad(&e))?,
                "seed" => damage.seed = value.parse().map_err(|e| bad(&e))?,
                _ => return Err(format!("`{key}`: expected erode, dilate, missing, swap or seed")),
            }
        }
        Ok(damage)
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [from, to, damage @ ..] = words.as_slice() else {
        return Err(
            "expected FROM TO [erode=PIXELS] [dilate=PIXELS] [missing=SHARE] [swap=SHARE] [seed=N]".into()
        );
    };
    let damage = Damage::parsed(damage)?;
    let masks = Path::new(to).join("masks");
    if masks.exists() {
        return Err(format!("{} is already there", masks.display()).into());
    }
    copy(Path::new(from), Path::new(to))?;
    for split in sorted(&masks)? {
        let files = sorted(&split)?;
        for file in &files {
            let mask = stored_pixels(file)?.into_luma8();
            spread(&mask, damage.dilate - damage.erode).save(file)?;
        }
        if split.ends_with(LEARNED) {
            damage_views(&files, &damage)?;
        }
    }
    Ok(())
}

/// Empties some masks and exchanges others in pairs.
fn damage_views(files: &[PathBuf], damage: &Damage) -> Result<(), Box<dyn Error>> {
    let share = |share: f64| (share * files.len() as f64).round() as usize;
    let mut order: Vec<usize> = (0..files.len()).collect();
    order.sort_by_key(|&k| mixed(damage.seed, k as u64));
    let (missing, rest) = order.split_at(share(damage.missing).min(files.len()));
    for &k in missing {
        let mask = stored_pixels(&files[k])?;
        GrayImage::new(mask.width(), mask.height()).save(&files[k])?;
        println!("missing {}", files[k].display());
    }
    let swapped = share(damage.swap).next_multiple_of(2);
    for pair in rest[..swapped.min(rest.len())].chunks_exact(2) {
        let (a, b) = (&files[pair[0]], &files[pair[1]]);
        let [of_a, of_b] = [fs::read(a)?, fs::read(b)?];
        fs::write(a, of_b)?;
        fs::write(b, of_a)?;
        println!("swapped {} {}", a.display(), b.display());
    }
    Ok(())
}

/// The mask grown by a disc of this radius [pixel], or shrunk where it is negative.
fn spread(mask: &GrayImage, by: i32) -> GrayImage {
    let (r, [w, h]) = (by.abs(), [mask.width() as i32, mask.height() as i32]);
    let around = (-r..=r).flat_map(|dy| (-r..=r).map(move |dx| (dx, dy)));
    let disc: Vec<(i32, i32)> = around.filter(|(dx, dy)| dx * dx + dy * dy <= r * r).collect();
    GrayImage::from_fn(mask.width(), mask.height(), |x, y| {
        let all = disc.iter().map(|(dx, dy)| {
            let at = [(x as i32 + dx).clamp(0, w - 1), (y as i32 + dy).clamp(0, h - 1)];
            mask.get_pixel(at[0] as u32, at[1] as u32).0[0]
        });
        Luma([if by < 0 { all.min() } else { all.max() }.unwrap_or(0)])
    })
}

/// Copies a folder with everything in it.
fn copy(from: &Path, to: &Path) -> std::io::Result<()> {
    fs::create_dir_all(to)?;
    for entry in sorted(from)? {
        let there = to.join(entry.file_name().unwrap_or_default());
        if entry.is_dir() {
            copy(&entry, &there)?;
        } else {
            fs::copy(&entry, there)?;
        }
    }
    Ok(())
}

/// What lies in a folder, by name.
fn sorted(folder: &Path) -> std::io::Result<Vec<PathBuf>> {
    let mut entries: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|e| e.map(|e| e.path())).collect::<Result<_, _>>()?;
    entries.sort();
    Ok(entries)
}

/// 64 bits for a counter. Source: SplitMix64 (Steele et al. 2014).
fn mixed(seed: u64, counter: u64) -> u64 {
    let mut z = seed.wrapping_add(counter.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}
