//! Decodes photographs one after the other, and keeps their numbers and, where asked for, small pictures.

use super::measures::{Measures, measure, reduced};
use crate::exit::{Exit, Failure, OrExit};
use crate::progress::{Show, counter};
use anyhow::Context;
use rayon::prelude::*;
use refraxel_data::{Dataset, Reduction, View, load_photo};
use refraxel_train::evaluation::truth;

/// Photographs that are looked at where no pictures are asked for.
pub const MOST: usize = 200;
/// Photographs that are decoded at the same time: one of 12 megapixels takes about 100 MB.
const AT_ONCE: usize = 4;
/// Longer edge of a small picture [pixel].
pub const EDGE: u32 = 240;

/// What was seen of one view.
pub struct Look {
    /// Index of the view.
    pub view: usize,
    /// The numbers; an error where the photograph cannot be decoded.
    pub measures: Result<Measures, String>,
    /// The picture, where it was asked for.
    pub picture: Option<SmallPicture>,
}

/// A photograph with few pixels.
pub struct SmallPicture {
    /// Width and height [pixel].
    pub size: [usize; 2],
    /// sRGB, rows from the top.
    pub pixels: Vec<[u8; 3]>,
    /// Coverage of the mask, where there is one.
    pub mask: Option<Vec<u8>>,
}

/// Which of `count` things are taken, where at most so many are: evenly spread, the first and the last among them.
pub fn evenly(count: usize, most: usize) -> Vec<usize> {
    if count <= most {
        return (0..count).collect();
    }
    (0..most).map(|k| k * (count - 1) / (most - 1).max(1)).collect()
}

/// Looks at the photographs of these views.
pub fn look(data: &Dataset, views: &[usize], with_pictures: bool, show: Show) -> Result<Vec<Look>, Failure> {
    let done = counter(show, "photographs", views.len());
    let seen = |&view: &usize| {
        let look = look_at(data, view, with_pictures);
        done();
        look
    };
    let threads = rayon::current_num_threads().min(AT_ONCE);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    let pool = pool.context("cannot start the threads that decode photographs").or_exit(Exit::Io)?;
    Ok(pool.install(|| views.par_iter().map(seen).collect()))
}

fn look_at(data: &Dataset, index: usize, with_picture: bool) -> Look {
    let view: &View = &data.views[index];
    let photo = match load_photo(view) {
        Ok(photo) => reduced(photo),
        Err(error) => return Look { view: index, measures: Err(error.to_string()), picture: None },
    };
    let measures = measure(&photo, view, data.backdrop);
    let picture = with_picture.then(|| {
        let size = Reduction::Longest(EDGE).size([photo.image.width, photo.image.height]);
        let small = photo.reduced(size);
        SmallPicture {
            size: size.map(|n| n as usize),
            pixels: truth(&small, data.backdrop),
            mask: small.mask.map(|mask| mask.coverage.clone()),
        }
    });
    Look { view: index, measures: Ok(measures), picture }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_of_many_are_spread_evenly() {
        assert_eq!(evenly(3, 5), [0, 1, 2]);
        assert_eq!(evenly(10, 4), [0, 3, 6, 9]);
        assert_eq!((evenly(0, 5), evenly(7, 1)), (vec![], vec![0]));
        let many = evenly(1000, 200);
        assert_eq!((many.len(), many[199]), (200, 999));
        assert!(many.windows(2).all(|w| w[0] < w[1]));
    }
}
