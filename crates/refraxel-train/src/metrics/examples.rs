//! Image pairs defined by a formula, so that other programs can build the same ones.

/// `height * width` pixels: a smooth wave with edges in it, and the same with errors of a few grey levels.
pub fn pair(width: usize, height: usize) -> (Vec<[u8; 3]>, Vec<[u8; 3]>) {
    let at = |i: usize, c: usize| {
        let (x, y) = (i % width, i / width);
        let base = (x * x + 3 * y * (c + 1) + 40 * ((x / 5 + y / 4) % 3)) % 200;
        let error = (7 * x + 11 * y + 5 * c + x * y) % 23;
        (base as u8 + 20, (base + 9 + error) as u8)
    };
    let image =
        |pick: fn((u8, u8)) -> u8| (0..width * height).map(|i| [0, 1, 2].map(|c| pick(at(i, c)))).collect();
    (image(|p| p.0), image(|p| p.1))
}

/// A disc of coverage 255 around the image's centre, half covered pixels at its rim.
pub fn disc(width: usize, height: usize) -> Vec<u8> {
    let r2 = (width.min(height) / 3).pow(2);
    (0..width * height)
        .map(|i| {
            let d2 = (i % width).abs_diff(width / 2).pow(2) + (i / width).abs_diff(height / 2).pow(2);
            if d2 < r2 { 255 } else { 127 * u8::from(d2 == r2) }
        })
        .collect()
}
