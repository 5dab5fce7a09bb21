//! Processes that `mpirun` or a batch system has started together.

use super::process_group::{Joined, ProcessGroup};
use super::refusals::unusable;
use crate::exit::{Failure, end_by};
use anyhow::anyhow;
use mpi::Threading;
use mpi::datatype::{Partition, PartitionMut};
use mpi::topology::SimpleCommunicator;
use mpi::traits::{Communicator as _, CommunicatorCollectives as _, Root as _};
use refraxel_train::communicator::Communicator;
use refraxel_train::cpu::{Root, serve};
use refraxel_train::device::DeviceChoice;
use std::sync::Arc;

/// Words that are broadcast at once; MPI counts to 2³¹.
const LARGEST: usize = 1 << 28;

/// Joins the other processes, if that is asked for. One that is not the first helps until the first has ended.
pub fn join(choice: DeviceChoice) -> Result<Joined, Failure> {
    if choice != DeviceChoice::Mpi {
        return Ok(Joined::Alone);
    }
    let Some((universe, _)) = mpi::initialize_with_threading(Threading::Serialized) else {
        return Err(unusable(anyhow!("MPI was started twice in one process")));
    };
    let (rank, count) = (number(universe.world().rank()), number(universe.world().size()));
    // No launcher need notice that one of them is gone, and the others would wait for it.
    end_by(|code| SimpleCommunicator::world().abort(code));
    let world = Arc::new(World { rank, count, _universe: universe });
    if rank == 0 {
        return Ok(Joined::Leads(ProcessGroup { root: Root::new(world), count }));
    }
    let communicator: Arc<dyn Communicator> = world;
    serve(&communicator);
    Ok(Joined::Helped)
}

/// All processes. The last copy ends MPI.
struct World {
    rank: usize,
    count: usize,
    _universe: mpi::environment::Universe,
}

/// A count of MPI's.
fn number(count: i32) -> usize {
    usize::try_from(count).expect("counts are not negative")
}

/// The same for MPI.
///
/// # Panics
/// Beyond 2³¹ words, 8 GiB in one message.
fn count(number: usize) -> i32 {
    i32::try_from(number).expect("a message of at most 8 GiB")
}

/// Where messages of so many words begin that follow each other.
fn places(counts: &[i32]) -> Vec<i32> {
    let ends = counts.iter().scan(0_usize, |end, &n| {
        *end += number(n);
        Some(*end)
    });
    std::iter::once(0).chain(ends).take(counts.len()).map(count).collect()
}

/// The messages of these lengths that follow each other.
fn parted(all: &[u32], counts: &[i32]) -> Vec<Vec<u32>> {
    let mut rest = all;
    let mut next = |&n: &i32| {
        let (message, after) = rest.split_at(number(n));
        rest = after;
        message.to_vec()
    };
    counts.iter().map(&mut next).collect()
}

impl Communicator for World {
    fn rank(&self) -> usize {
        self.rank
    }

    fn count(&self) -> usize {
        self.count
    }

    fn exchange(&self, messages: Vec<Vec<u32>>) -> Vec<Vec<u32>> {
        let world = SimpleCommunicator::world();
        let sent: Vec<i32> = messages.iter().map(|m| count(m.len())).collect();
        let mut received = vec![0_i32; self.count];
        world.all_to_all_into(&sent[..], &mut received[..]);
        let all = messages.concat();
        let mut told = vec![0_u32; received.iter().map(|&n| number(n)).sum()];
        let from = Partition::new(&all[..], sent.clone(), places(&sent));
        let mut to = PartitionMut::new(&mut told[..], received.clone(), places(&received));
        world.all_to_all_varcount_into(&from, &mut to);
        parted(&told, &received)
    }

    fn gather(&self, own: Vec<u32>) -> Vec<Vec<u32>> {
        let world = SimpleCommunicator::world();
        let mut counts = vec![0_i32; self.count];
        world.all_gather_into(&count(own.len()), &mut counts[..]);
        let mut told = vec![0_u32; counts.iter().map(|&n| number(n)).sum()];
        let mut to = PartitionMut::new(&mut told[..], counts.clone(), places(&counts));
        world.all_gather_varcount_into(&own[..], &mut to);
        parted(&told, &counts)
    }

    fn broadcast(&self, message: Vec<u32>) -> Vec<u32> {
        let world = SimpleCommunicator::world();
        let first = world.process_at_rank(0);
        let mut length = message.len() as u64;
        first.broadcast_into(&mut length);
        let mut told = message;
        told.resize(length as usize, 0);
        told.chunks_mut(LARGEST).for_each(|part| first.broadcast_into(part));
        told
    }
}
