//! The clock of a device, and the passes of kernels whose times it takes.

use serde::Serialize;

/// Passes that a clock takes the time of; wgpu has 4096 places in a set of queries.
const MOST_PASSES: u32 = wgpu::QUERY_SET_MAX_QUERIES / 2;

/// What all passes of a kernel have taken.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct KernelTime {
    /// Its name.
    pub kernel: &'static str,
    /// How many there were.
    pub passes: usize,
    /// Their sum by the clock of the device.
    pub seconds: f64,
}

/// Times of passes while they are taken.
#[derive(Debug)]
pub(crate) struct Clock {
    queries: wgpu::QuerySet,
    /// The kernels of all passes so far.
    passes: Vec<&'static str>,
}

impl Clock {
    pub(crate) fn new(device: &wgpu::Device) -> Self {
        let queries = device.create_query_set(&wgpu::QuerySetDescriptor {
            label: None,
            ty: wgpu::QueryType::Timestamp,
            count: 2 * MOST_PASSES,
        });
        Self { queries, passes: Vec::new() }
    }

    /// Where the times of another pass of this kernel go: the set, and the first of two places. `None` where it is full.
    pub(crate) fn place(&mut self, kernel: &'static str) -> Option<(wgpu::QuerySet, u32)> {
        let place = 2 * self.passes.len() as u32;
        (place < 2 * MOST_PASSES).then(|| {
            self.passes.push(kernel);
            (self.queries.clone(), place)
        })
    }

    /// Length of the times [byte].
    pub(crate) fn bytes(&self) -> u64 {
        16 * self.passes.len() as u64
    }

    /// Has the times written to a buffer.
    pub(crate) fn resolve(&self, encoder: &mut wgpu::CommandEncoder, to: &wgpu::Buffer) {
        encoder.resolve_query_set(&self.queries, 0..2 * self.passes.len() as u32, to, 0);
    }

    /// The sums per kernel, in the order in which these ran first, of the begin and end of each pass and the seconds of a tick.
    pub(crate) fn sums(self, times: &[u8], tick: f64) -> Vec<KernelTime> {
        let times: Vec<[u64; 2]> = bytemuck::pod_collect_to_vec(times);
        let mut sums: Vec<KernelTime> = Vec::new();
        for (kernel, [start, end]) in self.passes.into_iter().zip(times) {
            let seconds = end.saturating_sub(start) as f64 * tick;
            match sums.iter_mut().find(|t| t.kernel == kernel) {
                Some(known) => (known.passes, known.seconds) = (known.passes + 1, known.seconds + seconds),
                None => sums.push(KernelTime { kernel, passes: 1, seconds }),
            }
        }
        sums
    }
}
