//! Decoding: depth, alpha, orientation, linear images, masks, and files that are none.

use crate::fixture::*;
use image::codecs::jpeg::JpegEncoder;
use image::{DynamicImage, ImageBuffer, Rgba, RgbaImage};
use refraxel_core::{Camera, vec3};
use refraxel_data::{
    AlphaUse, Backdrop, DataError, Dataset, Format, LocalOrigin, Orientation, Photo, PhotoSource, Pixels,
    Reduction, Split, View, load_mask_of, load_photo,
};
use std::path::Path;

fn view(folder: &Path, name: &str, width: u32, height: u32) -> View {
    let camera =
        Camera::look_at(vec3(3.0, 0.0, 0.0), vec3(0.0, 0.0, 0.0), vec3(0.0, 0.0, 1.0), 0.7, [width, height]);
    View::of_file(folder.join(name), camera)
}

fn load(image: &DynamicImage, name: &str) -> Result<Photo, DataError> {
    let folder = tempfile::tempdir().unwrap();
    image.save(folder.path().join(name)).unwrap();
    load_photo(&view(folder.path(), name, image.width(), image.height()))
}

#[test]
fn eight_bit_images_keep_their_bytes_and_grey_becomes_rgb() {
    let rgba = RgbaImage::from_fn(3, 2, |x, y| Rgba([x as u8, y as u8, 7, 128]));
    let photo = load(&rgba.clone().into(), "a.png").unwrap();
    assert_eq!((photo.image.channels, &photo.image.pixels), (4, &Pixels::U8(rgba.into_raw())));
    let grey = DynamicImage::ImageLuma8(ImageBuffer::from_pixel(2, 1, image::Luma([9])));
    assert_eq!(load(&grey, "g.png").unwrap().image.pixels, Pixels::U8(vec![9; 6]));
}

#[test]
fn sixteen_bit_images_keep_their_precision() {
    let deep = DynamicImage::ImageRgb16(ImageBuffer::from_pixel(1, 1, image::Rgb([0, 257, 65535])));
    let expected = vec![0.0, 257.0 / 65535.0, 1.0];
    assert_eq!(load(&deep, "a.png").unwrap().image.pixels, Pixels::F32(expected));
}

#[test]
fn linear_images_are_divided_by_alpha_and_encoded_as_srgb() {
    let linear = DynamicImage::ImageRgba32F(ImageBuffer::from_pixel(1, 1, Rgba([0.1, 0.5, 0.0, 0.5])));
    let photo = load(&linear, "a.exr").unwrap();
    let [r, g, b, a] = photo.image.rgba(0);
    // sRGB of 0.2 is 0.48453, of 1 is 1.
    assert!((r - 0.484_53).abs() < 1e-4 && (g - 1.0).abs() < 1e-6 && b == 0.0 && a == 0.5, "{r} {g} {b} {a}");
}

#[test]
fn a_pixel_that_is_not_finite_is_named() {
    let mut linear = ImageBuffer::from_pixel(3, 2, image::Rgb([0.5_f32; 3]));
    linear.put_pixel(2, 1, image::Rgb([0.0, f32::NAN, 0.0]));
    let message = load(&DynamicImage::ImageRgb32F(linear), "a.exr").unwrap_err().to_string();
    assert!(message.contains("column 2, row 1") && message.contains("NaN"), "{message}");
}

#[test]
fn a_linear_pixel_that_is_no_colour_is_refused_with_its_file() {
    let with = |rgba: [f32; 4]| {
        let image = DynamicImage::ImageRgba32F(ImageBuffer::from_pixel(2, 1, Rgba(rgba)));
        load(&image, "a.exr").map_err(|e| e.to_string())
    };
    assert!(with([-0.001, 5.0, 0.2, 1.0]).is_ok() && with([0.0; 4]).is_ok());
    for (rgba, expected) in [
        ([-1.0, 0.5, 0.5, 1.0], "the colour value -12.92; expected -1 to 1000"),
        ([1e38, 0.5, 0.5, 1.0], "expected -1 to 1000"),
        ([0.5, 0.5, 0.5, -1.0], "the alpha -1; expected -0.01 to 1.01"),
        ([0.5, 0.5, 0.5, 5.0], "the alpha 5; expected"),
        ([0.5, 0.5, 0.5, 1e-38], "expected -1 to 1000"),
    ] {
        let message = with(rgba).unwrap_err();
        assert!(
            message.contains("a.exr: pixel (column 0, row 0)") && message.contains(expected),
            "{message}"
        );
    }
}

/// A JPEG with an EXIF orientation tag, 8 × 16 stored, left half dark.
fn turned_jpeg(orientation: u8) -> Vec<u8> {
    let picture = image::GrayImage::from_fn(16, 8, |x, _| image::Luma([if x < 8 { 0 } else { 255 }]));
    let mut jpeg = Vec::new();
    picture.write_with_encoder(JpegEncoder::new(&mut jpeg)).unwrap();
    with_orientation(&jpeg, orientation)
}

#[test]
fn exif_orientation_is_obeyed_where_the_view_means_upright_pixels() {
    let folder = tempfile::tempdir().unwrap();
    write_file(folder.path(), "a.jpg", turned_jpeg(6)); // turn by 90° clockwise: the left becomes the top
    let upright = load_photo(&view(folder.path(), "a.jpg", 8, 16)).unwrap().image;
    assert!(upright.rgba(3 * 8 + 4)[0] < 0.1 && upright.rgba(13 * 8 + 4)[0] > 0.9);
    let mut as_stored = view(folder.path(), "a.jpg", 16, 8);
    let PhotoSource::Files { orientation, .. } = &mut as_stored.source else { panic!("it is a file") };
    *orientation = Orientation::Stored;
    let stored = load_photo(&as_stored).unwrap().image;
    assert!(stored.rgba(4 * 16 + 2)[0] < 0.1 && stored.rgba(4 * 16 + 13)[0] > 0.9);
    let message = load_photo(&view(folder.path(), "a.jpg", 9, 9)).unwrap_err().to_string();
    assert!(message.contains("the image is 8x16, but its camera was read for 9x9"), "{message}");
}

#[test]
fn a_mask_of_another_size_names_both_sizes() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path(), "a.png", 4, 3);
    write_image(folder.path(), "m.png", 5, 3);
    let mut with_mask = view(folder.path(), "a.png", 4, 3);
    let (image, mask) = (folder.path().join("a.png"), Some(folder.path().join("m.png")));
    with_mask.source = PhotoSource::Files {
        image,
        mask,
        stored: None,
        orientation: Orientation::Upright,
        alpha: AlphaUse::Kept,
    };
    let message = load_photo(&with_mask).unwrap_err().to_string();
    assert!(message.contains("the mask is 5x3") && message.contains("is 4x3"), "{message}");
}

#[test]
fn truncated_images_and_other_files_are_errors_that_name_the_file() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path(), "whole.png", 6, 4);
    let png = std::fs::read(folder.path().join("whole.png")).unwrap();
    let jpeg = turned_jpeg(1);
    for (name, whole, [w, h]) in [("cut.png", png, [6, 4]), ("cut.jpg", jpeg, [16, 8])] {
        for cut in (0..whole.len() - 16).step_by(3) {
            write_file(folder.path(), name, &whole[..cut]);
            let error = load_photo(&view(folder.path(), name, w, h)).unwrap_err();
            assert!(error.to_string().contains(name), "{error}");
        }
    }
}

#[test]
fn an_image_that_claims_to_be_huge_is_refused_before_it_is_decoded() {
    let folder = tempfile::tempdir().unwrap();
    write_image(folder.path(), "a.png", 6, 4);
    let mut png = std::fs::read(folder.path().join("a.png")).unwrap();
    png[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]); // IHDR width and height
    let sum = crc32fast::hash(&png[12..29]);
    png[29..33].copy_from_slice(&sum.to_be_bytes());
    write_file(folder.path(), "a.png", png);
    let error = load_photo(&view(folder.path(), "a.png", 65535, 65535)).unwrap_err();
    assert!(matches!(error, DataError::TooLarge { found: 4_294_836_225, .. }), "{error}");
}

#[test]
fn views_that_are_reduced_show_means_of_their_files_and_masks() {
    let folder = tempfile::tempdir().unwrap();
    let chequer =
        RgbaImage::from_fn(6, 4, |x, y| Rgba([if (x + y) % 2 == 0 { 200 } else { 100 }, 0, 0, 255]));
    DynamicImage::from(chequer).into_rgb8().save(folder.path().join("a.png")).unwrap();
    let mask = ImageBuffer::from_fn(6, 4, |x, _| image::Luma([if x < 3 { 255_u8 } else { 0 }]));
    mask.save(folder.path().join("m.png")).unwrap();
    let mut whole = view(folder.path(), "a.png", 6, 4);
    let (image, mask) = (folder.path().join("a.png"), Some(folder.path().join("m.png")));
    whole.source = PhotoSource::Files {
        image,
        mask,
        stored: None,
        orientation: Orientation::Upright,
        alpha: AlphaUse::Kept,
    };
    let photo = load_photo(&whole).unwrap();
    let in_memory = View { source: PhotoSource::Memory(photo), ..whole.clone() };
    for from in [whole.clone(), in_memory] {
        let mut data = dataset(vec![from]);
        assert_eq!(data.reduce(&[0], Reduction::Divide(2)), 1);
        assert_eq!(data.reduce(&[0], Reduction::Longest(3)), 0, "it is as small already");
        let small = &data.views[0];
        assert_eq!([small.camera.width, small.camera.height], [3, 2]);
        assert_eq!(small.camera.focal[0], 0.5 * whole.camera.focal[0]);
        let photo = load_photo(small).unwrap();
        assert_eq!(photo.image.pixels, Pixels::U8([150, 0, 0].repeat(6)));
        assert_eq!(photo.mask.unwrap().coverage, [255, 128, 0, 255, 128, 0]);
        assert_eq!(load_mask_of(small).unwrap().unwrap().coverage, [255, 128, 0, 255, 128, 0]);
    }
    let mut again = dataset(vec![whole]);
    again.reduce(&[0], Reduction::Longest(4));
    again.reduce(&[0], Reduction::Divide(2));
    let photo = load_photo(&again.views[0]).unwrap();
    assert_eq!([photo.image.width, photo.image.height], [2, 2], "6 by 4 to 4 by 3 to 2 by 2");
}

fn dataset(views: Vec<View>) -> Dataset {
    let split = Split { train: (0..views.len()).collect(), ..Split::default() };
    Dataset {
        root: None,
        format: Format::Memory,
        origin: LocalOrigin::default(),
        views,
        split,
        backdrop: Backdrop::Surroundings,
        stated_box: None,
        up: None,
        points: Vec::new(),
        depth_range: None,
        truth: None,
        problems: Vec::new(),
    }
}
