//! How much fine detail a picture shows.

use image::GrayImage;

/// Mean square of the discrete Laplacian of the luma: blur lowers it more than anything that changes between two
/// frames. Pictures of fewer than 3 pixels along an edge have none.
pub fn detail(frame: &GrayImage) -> f64 {
    let (width, height) = (frame.width() as usize, frame.height() as usize);
    let at = |x: usize, y: usize| f64::from(frame.as_raw()[y * width + x]);
    if width < 3 || height < 3 {
        return 0.0;
    }
    let mut sum = 0.0;
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let laplacian = at(x - 1, y) + at(x + 1, y) + at(x, y - 1) + at(x, y + 1) - 4.0 * at(x, y);
            sum += laplacian * laplacian;
        }
    }
    sum / ((width - 2) * (height - 2)) as f64
}
