//! What a chunk of rays leaves behind for the update: one record per sample, sorted by the buckets of voxels it touches.
//!
//! A bucket is a run of [`BUCKET_SLOTS`] consecutive slots. Its owner alone adds up the gradients of its voxels, in the
//! order of the records, so the sum is the same for any number of threads, needs no locks, and stays in the L2 cache.

use super::layout::Basis;
use super::prefetch::prefetch;
use super::record::{CacheLookup, IndexSample, Record};
use super::sample::Sample;
use crate::backend::BUCKET_SLOTS;
use rayon::prelude::*;
use refraxel_core::BrickMap;
use refraxel_core::grid::{BRICK_VOXELS, Cell, EMPTY_SLOT};
use std::ops::Range;

/// Voxels of a bucket.
pub(super) const BUCKET_VOXELS: usize = BUCKET_SLOTS * BRICK_VOXELS;

/// Records of a chunk of rays.
#[derive(Debug, Default)]
pub(super) struct Tape {
    pub records: Vec<Record>,
    /// SH bases of the directions of the chunk's segments.
    pub bases: Vec<Basis>,
    /// Index samples of the chunk's bent paths.
    pub index_samples: Vec<IndexSample>,
    /// Look-ups in radiance caches.
    pub lookups: Vec<CacheLookup>,
    /// dLoss/d(absorption coefficients) of each region; empty where nothing absorbs and nothing learns to.
    pub absorption: Vec<[f64; 3]>,
    /// Segments that taught nothing to these coefficients since their derivative overflowed.
    pub overflows: u64,
    /// (texel, dLoss/dtexel) of the background.
    pub texels: Vec<(u32, [f32; 3])>,
    /// Records of bucket b: `order[first[b] .. first[b + 1]]`.
    order: Vec<u32>,
    first: Vec<u32>,
    /// (bucket, record) pairs that await sorting.
    touched: Vec<(u32, u32)>,
}

/// Arrays that adjoints are scattered to side by side. Part of the arithmetic: it fixes the order of sums.
const PARTS: usize = 4;

/// The sum over all tapes of what `add` adds to `zero`, in a few parts that `merge` puts together in order: the same for any
/// number of threads.
pub(super) fn sum_in_parts<S: Send>(
    tapes: &[Tape],
    zero: impl Fn() -> S + Sync,
    add: impl Fn(&mut S, &Tape) + Sync,
    merge: impl Fn(&mut S, S),
) -> S {
    let of = |tapes: &[Tape]| {
        let mut sums = zero();
        tapes.iter().for_each(|tape| add(&mut sums, tape));
        sums
    };
    let parts: Vec<S> = tapes.par_chunks(tapes.len().div_ceil(PARTS).max(1)).map(of).collect();
    let mut parts = parts.into_iter();
    let mut total = parts.next().unwrap_or_else(&zero);
    parts.for_each(|part| merge(&mut total, part));
    total
}

/// Number of buckets of a map.
pub(super) fn buckets(map: &BrickMap) -> usize {
    map.slots().div_ceil(BUCKET_SLOTS)
}

impl Tape {
    /// Note which buckets the records of a ray touch, which begin with `first` and belong to these samples in their order. A
    /// record near the face of its brick belongs to every bucket that holds one of its corners.
    #[inline(always)]
    pub(super) fn touch(&mut self, first: usize, samples: &[Sample]) {
        for (i, s) in (first as u32..).zip(samples) {
            self.touch_corners(s.cell, &s.corners, i);
        }
    }

    /// The same for the records from `first` on, without their samples.
    pub(super) fn touch_from(&mut self, first: usize, map: &BrickMap) {
        for i in first..self.records.len() {
            let cell = self.records[i].cell;
            self.touch_corners(cell, &map.corners(cell), i as u32);
        }
    }

    #[inline(always)]
    fn touch_corners(&mut self, cell: Cell, corners: &[u32; 8], record: u32) {
        let own = cell.slot / BUCKET_SLOTS as u32;
        self.touched.push((own, record));
        let mut differing = 0;
        for k in 1..8 {
            differing |= corners[k] ^ corners[0];
        }
        if differing as usize >= BUCKET_VOXELS {
            push_other_buckets(corners, own, record, &mut self.touched);
        }
    }

    /// Note which buckets all records touch, and sort them.
    pub(super) fn sort(&mut self, map: &BrickMap) {
        self.touched.clear();
        self.touch_from(0, map);
        self.sort_touched(map);
    }

    /// Sort the records by the buckets that they touch (stable).
    pub(super) fn sort_touched(&mut self, map: &BrickMap) {
        self.first.clear();
        self.first.resize(buckets(map) + 1, 0);
        let touched = std::mem::take(&mut self.touched);
        for &(bucket, _) in &touched {
            self.first[bucket as usize + 1] += 1;
        }
        for b in 1..self.first.len() {
            self.first[b] += self.first[b - 1];
        }
        let mut next = self.first.clone();
        self.order.resize(touched.len(), 0);
        for &(bucket, record) in &touched {
            let at = &mut next[bucket as usize];
            self.order[*at as usize] = record;
            *at += 1;
        }
        self.touched = touched;
    }

    /// Forget the records, keep the memory.
    pub(super) fn clear(&mut self) {
        self.records.clear();
        self.bases.clear();
        self.index_samples.clear();
        self.lookups.clear();
        self.absorption.clear();
        self.overflows = 0;
        self.texels.clear();
        self.touched.clear();
    }

    /// The numbers of the records that touch any of some buckets, in their order.
    pub(super) fn touching(&self, buckets: &Range<usize>) -> Vec<u32> {
        let touching = &self.order[self.first[buckets.start] as usize..self.first[buckets.end] as usize];
        let mut numbers = touching.to_vec();
        numbers.sort_unstable();
        numbers.dedup();
        numbers
    }

    /// The numbers of the records that touch a bucket.
    #[inline(always)]
    fn order_of(&self, bucket: usize) -> &[u32] {
        &self.order[self.first[bucket] as usize..self.first[bucket + 1] as usize]
    }

    /// The records that touch a bucket, in the order of their rays; later ones are fetched ahead, and then their bases.
    #[inline(always)]
    pub(super) fn of_bucket(&self, bucket: usize) -> impl Iterator<Item = &Record> {
        const SOON: usize = 4;
        let order = self.order_of(bucket);
        order.iter().enumerate().map(move |(k, &i)| {
            if let Some(&next) = order.get(k + AHEAD) {
                self.fetch(next);
            }
            if let Some(&soon) = order.get(k + SOON) {
                prefetch(&self.bases, self.records[soon as usize].basis as usize);
            }
            &self.records[i as usize]
        })
    }

    /// Fetch a record, which may end in the line after that where it begins.
    #[inline(always)]
    fn fetch(&self, record: u32) {
        prefetch(&self.records, record as usize);
        prefetch(&self.records, record as usize + 1);
    }
}

/// Records between prefetch and use.
const AHEAD: usize = 12;

/// Fetch what the records of a bucket begin with in the tapes after number `current`: one needs the range of its numbers, the
/// one before that the numbers, and the next one the records. Most tapes have but few records of a bucket.
#[inline(always)]
pub(super) fn fetch_ahead(tapes: &[Tape], current: usize, bucket: usize) {
    if let Some(tape) = tapes.get(current + 3) {
        prefetch(&tape.first, bucket);
    }
    if let Some(tape) = tapes.get(current + 2) {
        prefetch(&tape.order, tape.first[bucket] as usize);
    }
    if let Some(tape) = tapes.get(current + 1) {
        tape.order_of(bucket).iter().take(AHEAD).for_each(|&record| tape.fetch(record));
    }
}

fn push_other_buckets(corners: &[u32; 8], own: u32, record: u32, touched: &mut Vec<(u32, u32)>) {
    let mut seen = [own; 9];
    let mut n = 1;
    for &v in corners {
        let slot = v / BRICK_VOXELS as u32;
        let bucket = slot / BUCKET_SLOTS as u32;
        if slot != EMPTY_SLOT && !seen[..n].contains(&bucket) {
            seen[n] = bucket;
            n += 1;
            touched.push((bucket, record));
        }
    }
}
