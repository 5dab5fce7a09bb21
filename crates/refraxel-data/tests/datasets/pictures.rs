//! Files of pictures: formats that are read and those that have to be converted, colour profiles, and sizes.

use crate::fixture::*;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, GrayImage, ImageBuffer, ImageEncoder, Rgb, RgbImage};
use refraxel_data::{DataError, Dataset, OpenOptions, Reduction, Severity, load_photo};
use serde_json::json;
use std::path::Path;
use tempfile::TempDir;

fn picture() -> RgbImage {
    RgbImage::from_fn(WIDTH, HEIGHT, |x, y| Rgb([(9 * x) as u8, (13 * y) as u8, (x * y % 256) as u8]))
}

/// A folder whose frames name these files; nothing is written but `transforms.json`.
fn naming(names: &[&str]) -> TempDir {
    let folder = transforms_folder(names.len(), |file| {
        for (frame, name) in file["frames"].as_array_mut().unwrap().iter_mut().zip(names) {
            frame["file_path"] = json!(name);
        }
    });
    std::fs::remove_dir_all(folder.path().join("images")).unwrap();
    folder
}

fn open(folder: &Path) -> Result<Dataset, DataError> {
    Dataset::open(folder, &OpenOptions::default())
}

fn refusal(names: &[&str], write: impl FnOnce(&Path)) -> String {
    let folder = naming(names);
    write(folder.path());
    open(folder.path()).map(|_| ()).unwrap_err().to_string()
}

#[test]
fn every_format_without_loss_gives_the_same_pixels() {
    let names = ["a.png", "b.webp", "c.tif", "d.TIFF", "e.bmp", "f.ppm", "g.tga"];
    let folder = naming(&names);
    for name in names {
        DynamicImage::from(picture()).save(folder.path().join(name)).unwrap();
    }
    let data = open(folder.path()).unwrap();
    assert_eq!(data.views.len(), names.len());
    let first = load_photo(&data.views[0]).unwrap();
    for view in &data.views {
        assert_eq!(load_photo(view).unwrap(), first, "{}", view.name);
    }
}

#[test]
fn grey_and_palettes_become_colours() {
    let folder = naming(&["a.pgm", "b.png", "c.tif"]);
    let grey = DynamicImage::from(picture()).into_luma8();
    for name in ["a.pgm", "b.png", "c.tif"] {
        grey.save(folder.path().join(name)).unwrap();
    }
    for view in &open(folder.path()).unwrap().views {
        let [r, g, b, a] = load_photo(view).unwrap().image.rgba(30);
        assert!(r == g && g == b && a == 1.0 && r == f32::from(grey.as_raw()[30]) / 255.0);
    }
}

#[test]
fn formats_that_are_not_read_are_named_with_what_converts_them() {
    let heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic".as_slice();
    let message = refusal(&["IMG_1.HEIC", "b", "c"], |folder| {
        for name in ["IMG_1.HEIC", "b.png", "c.png"] {
            write_file(folder, name, heic);
        }
    });
    assert!(
        message.contains("IMG_1.HEIC: ") && message.contains("heif-convert IMG_1.HEIC IMG_1.jpg"),
        "{message}"
    );
    // A raw file is a TIFF that holds a small preview.
    let message = refusal(&["a.dng", "a.dng", "a.dng"], |folder| {
        picture().save(folder.join("a.tif")).unwrap();
        std::fs::rename(folder.join("a.tif"), folder.join("a.dng")).unwrap();
    });
    assert!(message.contains("a.dng") && !message.contains("convert"), "one image thrice: {message}");
    let message = refusal(&["a.dng", "b.dng", "c.dng"], |folder| {
        for name in ["a", "b", "c"] {
            picture().save(folder.join("x.tif")).unwrap();
            std::fs::rename(folder.join("x.tif"), folder.join(format!("{name}.dng"))).unwrap();
        }
    });
    assert!(message.contains("darktable-cli a.dng a.jpg"), "{message}");
    // Phones that share a picture under another name do not change its content.
    let message = refusal(&["a.jpg", "b.jpg", "c.jpg"], |folder| {
        for name in ["a.jpg", "b.jpg", "c.jpg"] {
            write_file(folder, name, heic);
        }
    });
    assert!(message.contains("a.jpg") && message.contains("heif-convert"), "{message}");
}

#[test]
fn a_jpeg_that_is_called_heic_is_read() {
    let names = ["a.HEIC", "b.HEIC", "c.HEIC"];
    let folder = naming(&names);
    for name in names {
        picture().save(folder.path().join("x.jpg")).unwrap();
        std::fs::rename(folder.path().join("x.jpg"), folder.path().join(name)).unwrap();
    }
    let data = open(folder.path()).unwrap();
    assert!(load_photo(&data.views[2]).is_ok());
}

#[test]
fn a_picture_of_one_row_or_column_is_refused() {
    for [w, h] in [[1, 1], [1, 16], [24, 1]] {
        let message = refusal(&["a", "b", "c"], |folder| {
            ["a.png", "b.png"].iter().for_each(|name| picture().save(folder.join(name)).unwrap());
            RgbImage::new(w, h).save(folder.join("c.png")).unwrap();
        });
        assert!(
            message.contains(&format!("c.png: the image is {w}x{h}; expected at least 2 columns")),
            "{message}"
        );
    }
    let message = refusal(&["a", "b", "c"], |folder| {
        ["a.png", "b.png"].iter().for_each(|name| picture().save(folder.join(name)).unwrap());
        write_file(folder, "c.png", b"");
    });
    assert!(message.contains("0 bytes: c"), "{message}");
}

/// A profile of RGB that has nothing but its name.
fn profile(name: &str) -> Vec<u8> {
    let mut all = vec![0; 128];
    all[16..20].copy_from_slice(b"RGB ");
    all.extend(1_u32.to_be_bytes());
    all.extend(b"desc");
    all.extend(144_u32.to_be_bytes());
    all.extend((13 + name.len() as u32).to_be_bytes());
    all.extend(b"desc\0\0\0\0");
    all.extend((1 + name.len() as u32).to_be_bytes());
    all.extend(name.bytes().chain([0]));
    all
}

fn jpeg(path: &Path, profiled: Option<&str>) {
    let mut bytes = Vec::new();
    let mut encoder = JpegEncoder::new(&mut bytes);
    profiled.into_iter().for_each(|name| encoder.set_icc_profile(profile(name)).unwrap());
    picture().write_with_encoder(encoder).unwrap();
    std::fs::write(path, bytes).unwrap();
}

#[test]
fn colour_profiles_other_than_srgb_are_said_and_doubted_where_pictures_differ() {
    let names = ["a.jpg", "b.jpg", "c.jpg"];
    for (profiles, expected) in [
        ([Some("sRGB IEC61966-2.1"), None, None], None),
        ([Some("Display P3"); 3], Some(Severity::Note)),
        ([Some("Display P3"), None, None], Some(Severity::Warning)),
        ([Some("Display P3"), Some("Display P3"), Some("Adobe RGB (1998)")], Some(Severity::Warning)),
    ] {
        let folder = naming(&names);
        names.iter().zip(profiles).for_each(|(name, profile)| jpeg(&folder.path().join(name), profile));
        let data = open(folder.path()).unwrap();
        let said = data.problems.iter().find(|p| p.message.contains("colour profile"));
        assert_eq!(said.map(|p| p.severity), expected, "{profiles:?}");
        assert!(said.is_none_or(|p| p.message.contains("Display P3")), "{said:?}");
    }
}

/// A PNG that says that it has this size; its pixels are fewer.
fn png_of_size(path: &Path, size: [u32; 2]) {
    GrayImage::new(6, 4).save(path).unwrap();
    let mut png = std::fs::read(path).unwrap();
    png[16..20].copy_from_slice(&size[0].to_be_bytes());
    png[20..24].copy_from_slice(&size[1].to_be_bytes());
    let sum = crc32fast::hash(&png[12..29]);
    png[29..33].copy_from_slice(&sum.to_be_bytes());
    std::fs::write(path, png).unwrap();
}

#[test]
fn photographs_that_are_too_large_are_read_smaller_and_with_a_word() {
    let folder = naming(&["a.png", "b.png", "c.png"]);
    png_of_size(&folder.path().join("a.png"), [11656, 8742]);
    for name in ["b.png", "c.png"] {
        picture().save(folder.path().join(name)).unwrap();
    }
    let mut data = open(folder.path()).unwrap();
    let whole = data.clone();
    assert_eq!(data.fit(), Some(Reduction::Longest(4704)));
    let note = &data.problems.last().unwrap().message;
    assert!(note.contains("1 of 3 images") && note.contains("11656x8742 at 4704x3528"), "{note}");
    assert!(note.contains("--downscale 1"), "{note}");
    assert_eq!(data.fit(), None, "once is enough");
    let [small, camera] = [&data, &whole].map(|data| data.views[0].camera);
    assert_eq!([small.width, small.height], [4704, 3528]);
    assert!((small.focal[0] / camera.focal[0] - 4704.0 / 11656.0).abs() < 1e-9);
    assert!(data.views[1].camera == whole.views[1].camera);
    png_of_size(&folder.path().join("a.png"), [20000, 14000]);
    assert!(matches!(open(folder.path()), Err(DataError::TooLarge { .. })));
}

/// The dataset whose frames name these files, in which each is this picture.
fn showing(names: &[&str], of: impl Fn(&str) -> DynamicImage) -> Dataset {
    let folder = naming(names);
    names.iter().for_each(|name| of(name).save(folder.path().join(name)).unwrap());
    open(folder.path()).unwrap()
}

#[test]
fn the_bits_of_a_sensor_that_are_stored_in_more_are_said() {
    let names = ["a.png", "b.png", "c.png", "d.png"];
    let dark = |scale: u16| {
        let value = |v: u8| u16::from(v) * scale;
        let deep = ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| Rgb(picture().get_pixel(x, y).0.map(value)));
        showing(&names, |_| DynamicImage::ImageRgb16(deep.clone()))
    };
    let text = "multiply all of them by the same number";
    assert!(reports(&dark(16), text), "12 bits of 16");
    assert!(reports(&dark(64), text), "14 bits of 16");
    assert!(!reports(&dark(257), text), "all bits");
}

#[test]
fn values_far_above_white_are_doubted() {
    let names = ["a.exr", "b.exr", "c.exr", "d.exr"];
    let with = |scale: f32| {
        let value = |v: u8| f32::from(v) * scale;
        let deep = ImageBuffer::from_fn(WIDTH, HEIGHT, |x, y| Rgb(picture().get_pixel(x, y).0.map(value)));
        showing(&names, |_| DynamicImage::ImageRgb32F(deep.clone()))
    };
    let text = "above white, which is 1";
    assert!(warns(&with(1.0), text), "values up to 255");
    assert!(!warns(&with(1.0 / 255.0), text), "values up to 1");
}

#[test]
fn grey_photographs_among_coloured_ones_are_doubted() {
    let names = ["a.png", "b.png", "c.png", "d.png"];
    let with = |grey: &[&str]| {
        let coloured = DynamicImage::from(picture());
        let of_grey = DynamicImage::from(coloured.to_luma8());
        showing(&names, |name| if grey.contains(&name) { of_grey.clone() } else { coloured.clone() })
    };
    assert!(warns(&with(&names[1..3]), "2 of 4 images are stored without colours"));
    for grey in [&names[..], &[]] {
        assert!(!warns(&with(grey), "without colours"));
    }
}
