//! The pixels inside refractive masks, numbered through all views.
//!
//! A list of them would take eight bytes per pixel of glass. Counts per row take eight bytes per row of the masks; the
//! row is then looked through.

use refraxel_data::{Mask, is_white};

/// Numbers of the pixels that lie mostly inside the refractive mask of their view, by view, row and column.
pub(super) struct InsidePixels {
    /// Pixels before each row of each view, and in all.
    before: Vec<u64>,
    /// The first row of each view, and the number of all rows.
    rows: Vec<usize>,
}

impl InsidePixels {
    /// Counts the pixels of the views' masks, where they have some.
    pub fn new<'a>(masks: impl Iterator<Item = Option<&'a Mask>>) -> Self {
        let (mut before, mut rows) = (vec![0], vec![0]);
        for mask in masks {
            for row in mask.iter().flat_map(|m| m.coverage.chunks(m.width.max(1) as usize)) {
                let inside = row.iter().filter(|c| is_white(**c)).count() as u64;
                before.push(before[before.len() - 1] + inside);
            }
            rows.push(before.len() - 1);
        }
        Self { before, rows }
    }

    /// How many there are.
    pub fn count(&self) -> u64 {
        self.before[self.before.len() - 1]
    }

    /// The view of pixel number `k`, which must be less than [`Self::count`].
    pub fn view(&self, k: u64) -> usize {
        let row = self.row(k);
        self.rows.partition_point(|&first| first <= row) - 1
    }

    /// Where pixel number `k` lies in the mask of its view: row · width + column.
    pub fn pixel(&self, k: u64, mask: &Mask) -> Option<usize> {
        let row = self.row(k);
        let width = mask.width as usize;
        let start = (row - self.rows[self.view(k)]) * width;
        let inside =
            mask.coverage.get(start..start + width)?.iter().enumerate().filter(|(_, c)| is_white(**c));
        let (column, _) = { inside }.nth((k - self.before[row]) as usize)?;
        Some(start + column)
    }

    /// The row, numbered through all views, of pixel number `k`.
    fn row(&self, k: u64) -> usize {
        self.before.partition_point(|&before| before <= k) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_are_numbered_as_in_a_list_of_all() {
        let mask = |width: u32, height: u32, k: u32| {
            let coverage = (0..width * height).map(|i| if i * i % 7 < k { 200 } else { 100 }).collect();
            Some(Mask { width, height, coverage })
        };
        let masks = [None, mask(5, 4, 3), mask(3, 6, 0), mask(4, 4, 2), None, mask(2, 2, 7)];
        let listed: Vec<(usize, usize)> = masks
            .iter()
            .enumerate()
            .flat_map(|(view, m)| m.iter().map(move |m| (view, m)))
            .flat_map(|(view, m)| {
                (0..m.coverage.len()).filter(|&p| is_white(m.coverage[p])).map(move |p| (view, p))
            })
            .collect();
        let inside = InsidePixels::new(masks.iter().map(Option::as_ref));
        let found = (0..inside.count()).map(|k| {
            let view = inside.view(k);
            (view, inside.pixel(k, masks[view].as_ref().unwrap()).unwrap())
        });
        assert_eq!(found.collect::<Vec<_>>(), listed);
        assert!(listed.len() > 20);
    }
}
