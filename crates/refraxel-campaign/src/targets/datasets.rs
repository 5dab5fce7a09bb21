//! Descriptions of datasets, photographs and masks.

use super::small::{ball, open_and_train};
use super::{Answer, Target};
use crate::fuzz::Format;
use fixture::{
    cameras, colmap_binary, colmap_text, llff, nsvf_pose, stem, transforms, write_colmap, write_file,
};
use image::{DynamicImage, GrayImage, Luma, Rgb, Rgb32FImage, RgbImage, Rgba, RgbaImage};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// The writers of small datasets that the tests of `refraxel-data` use.
#[path = "../../../refraxel-data/tests/fixture/mod.rs"]
mod fixture;

/// Photographs of a dataset: few, and enough that some are held out.
const VIEWS: usize = 4;
const SIZE: [u32; 2] = [fixture::WIDTH, fixture::HEIGHT];

pub fn targets() -> Vec<Target> {
    use Format::{Binary, Png, Text};
    let target = |name, format, prepare| Target { name, format, prepare, ask };
    vec![
        target("blender", Text, |at| ball(at).map(|()| at.join("transforms_train.json"))),
        target("nerfstudio", Text, |at| described(at, json!({ "k1": 0.01, "p1": 1e-3 }))),
        target("nerfstudio-fisheye", Text, |at| {
            described(at, json!({ "camera_model": "OPENCV_FISHEYE", "k1": 0.01, "k4": 1e-3 }))
        }),
        target("instant-ngp", Text, |at| {
            let more = json!({ "camera_angle_x": 0.8, "aabb_scale": 4, "scale": 0.5, "offset": [0.5, 0.5, 0.5],
                               "render_aabb": [[-1, -1, -1], [1, 1, 1]] });
            described(at, more)
        }),
        target("panorama", Text, |at| described(at, json!({ "camera_model": "EQUIRECTANGULAR" }))),
        target("points-ply-text", Text, |at| points(at, "ascii", &points_text())),
        target("points-ply", Binary, |at| points(at, "binary_little_endian", &points_binary())),
        target("colmap-cameras-bin", Binary, |at| colmap_bin(at, "cameras")),
        target("colmap-images-bin", Binary, |at| colmap_bin(at, "images")),
        target("colmap-points-bin", Binary, |at| colmap_bin(at, "points3D")),
        target("colmap-cameras-txt", Text, |at| colmap_txt(at, "cameras")),
        target("colmap-images-txt", Text, |at| colmap_txt(at, "images")),
        target("colmap-points-txt", Text, |at| colmap_txt(at, "points3D")),
        target("llff", Binary, |at| {
            pictures(at)?;
            write_file(at, "poses_bounds.npy", llff(&cameras(VIEWS)));
            Ok(at.join("poses_bounds.npy"))
        }),
        target("nsvf-pose", Text, |at| nsvf(at, "pose/r_1.txt")),
        target("nsvf-intrinsics", Text, |at| nsvf(at, "intrinsics.txt")),
        target("nsvf-bbox", Text, |at| nsvf(at, "bbox.txt")),
        target("png", Png, |at| picture(at, "png", &RgbImage::from_fn(SIZE[0], SIZE[1], coloured).into())),
        target("png-rgba", Png, |at| {
            let pixel = |x, y| Rgba([(x * 9) as u8, (y * 15) as u8, 90, (x * 10) as u8]);
            picture(at, "png", &RgbaImage::from_fn(SIZE[0], SIZE[1], pixel).into())
        }),
        target("png-16", Png, |at| {
            let image = DynamicImage::ImageRgb8(RgbImage::from_fn(SIZE[0], SIZE[1], coloured)).to_rgb16();
            picture(at, "png", &image.into())
        }),
        target("jpeg", Binary, |at| {
            picture(at, "jpg", &RgbImage::from_fn(SIZE[0], SIZE[1], coloured).into())
        }),
        target("exr", Binary, |at| {
            let pixel = |x, y| Rgb([x as f32 * 0.04, y as f32 * 0.06, 0.3]);
            picture(at, "exr", &Rgb32FImage::from_fn(SIZE[0], SIZE[1], pixel).into())
        }),
        target("mask", Png, |at| {
            let mask =
                GrayImage::from_fn(SIZE[0], SIZE[1], |x, y| Luma([if x > 8 && y > 5 { 255 } else { 0 }]));
            described(at, json!({}))?;
            for i in 0..VIEWS {
                std::fs::create_dir_all(at.join("glass_masks"))?;
                mask.save(at.join(format!("glass_masks/{}.png", stem(i))))?;
            }
            Ok(at.join("glass_masks/r_1.png"))
        }),
    ]
}

fn ask(folder: &Path, _file: &Path) -> Answer {
    open_and_train(folder)
}

fn coloured(x: u32, y: u32) -> Rgb<u8> {
    Rgb([(x * 9) as u8, (y * 15) as u8, 90])
}

fn pictures(at: &Path) -> anyhow::Result<()> {
    std::fs::create_dir_all(at.join("images"))?;
    let image = RgbImage::from_fn(SIZE[0], SIZE[1], coloured);
    (0..VIEWS).try_for_each(|i| Ok(image.save(at.join(format!("images/{}.png", stem(i))))?))
}

/// `transforms.json` with more keys.
fn described(at: &Path, more: Value) -> anyhow::Result<PathBuf> {
    pictures(at)?;
    let mut value = transforms(&cameras(VIEWS));
    for (key, content) in more.as_object().into_iter().flatten() {
        value[key] = content.clone();
    }
    write_file(at, "transforms.json", serde_json::to_string_pretty(&value)?);
    Ok(at.join("transforms.json"))
}

/// Points [scene unit] that a description names as those that its cameras were found with.
const POINTS: [[f32; 3]; 5] =
    [[-0.4, -0.4, -0.5], [0.4, -0.4, -0.5], [0.0, 0.4, -0.5], [0.0, 0.0, 0.3], [0.2, 0.1, 0.0]];

/// A dataset of nerfstudio with such points.
fn points(at: &Path, format: &str, body: &[u8]) -> anyhow::Result<PathBuf> {
    described(at, json!({ "ply_file_path": "points.ply" }))?;
    let head = format!(
        "ply\nformat {format} 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
        POINTS.len()
    );
    write_file(at, "points.ply", [head.as_bytes(), body].concat());
    Ok(at.join("points.ply"))
}

fn points_text() -> Vec<u8> {
    POINTS.map(|[x, y, z]| format!("{x} {y} {z} 200 100 50\n")).concat().into_bytes()
}

fn points_binary() -> Vec<u8> {
    let point = |p: &[f32; 3]| [p.map(f32::to_le_bytes).concat(), vec![200, 100, 50]].concat();
    POINTS.iter().flat_map(point).collect()
}

/// A dataset one of whose photographs has this format.
fn picture(at: &Path, extension: &str, image: &DynamicImage) -> anyhow::Result<PathBuf> {
    pictures(at)?;
    let name = format!("images/r_1.{extension}");
    let mut value = transforms(&cameras(VIEWS));
    value["frames"][1]["file_path"] = json!(name);
    write_file(at, "transforms.json", value.to_string());
    image.save(at.join(&name))?;
    Ok(at.join(name))
}

fn colmap_bin(at: &Path, name: &str) -> anyhow::Result<PathBuf> {
    pictures(at)?;
    write_colmap(at, "sparse/0", "bin", colmap_binary(&cameras(VIEWS)));
    Ok(at.join(format!("sparse/0/{name}.bin")))
}

fn colmap_txt(at: &Path, name: &str) -> anyhow::Result<PathBuf> {
    pictures(at)?;
    write_colmap(at, "sparse/0", "txt", colmap_text(&cameras(VIEWS)));
    Ok(at.join(format!("sparse/0/{name}.txt")))
}

fn nsvf(at: &Path, name: &str) -> anyhow::Result<PathBuf> {
    pictures(at)?;
    for (i, camera) in cameras(VIEWS).iter().enumerate() {
        write_file(at, &format!("pose/{}.txt", stem(i)), nsvf_pose(camera));
    }
    write_file(at, "intrinsics.txt", "30 12 8 0.\n0. 0. 0.\n");
    write_file(at, "bbox.txt", "-1 -1 -1 1 1 1 0.1");
    Ok(at.join(name))
}
