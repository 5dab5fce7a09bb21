//! Some rays, what they meet, and what absorbs it: the memory that the stages of a walk share.

use super::mirrored::MirroredSample;
use super::sample::Samples;
use refraxel_core::optics::PartialReflection;
use refraxel_core::radiance::{Absorption, Filter, Filtered};
use refraxel_core::{Path, Ray};
use std::ops::Range;

/// Rays marched before their samples are shaded: enough samples to prefetch across rays, few enough for the L2 cache.
pub(super) const PACKET: usize = 8;

/// One ray of a packet, in the order in which the stages find it out.
#[derive(Clone, Debug)]
pub(super) struct PacketRay {
    /// Trace: the path bends, and the ray that reaches the background.
    pub bent: bool,
    pub exit: Ray<f32>,
    /// March: its samples in the packet's, and the transmittance at its end.
    pub samples: Range<usize>,
    pub left: f32,
    /// Mirror: its mirrored samples in the packet's.
    pub mirrored: Range<usize>,
    /// Absorb: what absorbs light from the background.
    pub through: Filter<f32>,
}

/// The filtered colours of samples, in their order.
#[derive(Default)]
pub(super) struct Absorbed {
    /// Of the ray at hand.
    pub along: Absorption<f32>,
    pub filtered: Vec<Filtered<f32>>,
}

/// Some rays and what they meet. Memory of one thread, written over by the next packet.
#[derive(Default)]
pub(super) struct Packet {
    pub seen: Samples,
    pub rays: Vec<PacketRay>,
    /// The paths, one per ray of the packet. A straight one has its segment alone, or none beside the scene.
    pub paths: [Path<f32>; PACKET],
    pub mirrored: Vec<MirroredSample>,
    pub absorbed: Absorbed,
    /// Reflections of the path at hand.
    pub reflections: Vec<PartialReflection<f32>>,
}
