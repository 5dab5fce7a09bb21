//! Room for pictures while they are decoded: large ones wait for each other, so that memory does not grow with the threads.

use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Whole pictures that are in memory at once while they are decoded [byte], if none of them alone is larger.
const ALL: u64 = 3 << 28;

/// How much of [`ALL`] is taken [byte].
static TAKEN: Mutex<u64> = Mutex::new(0);
/// Told when some of it is free again.
static FREED: Condvar = Condvar::new();

/// Room that is taken until this is dropped.
#[derive(Debug)]
pub(crate) struct Room(u64);

impl Room {
    /// Waits until there is room for so many bytes; more than all there is waits for all of it. What is done in it must not
    /// wait for other threads.
    pub fn take(bytes: u64) -> Self {
        let bytes = bytes.min(ALL);
        let mut taken = locked();
        while *taken + bytes > ALL {
            taken = FREED.wait(taken).unwrap_or_else(PoisonError::into_inner);
        }
        *taken += bytes;
        Self(bytes)
    }
}

impl Drop for Room {
    fn drop(&mut self) {
        *locked() -= self.0;
        FREED.notify_all();
    }
}

fn locked() -> MutexGuard<'static, u64> {
    TAKEN.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicU64, Ordering};

    #[test]
    fn pictures_that_are_too_large_for_each_other_are_decoded_one_after_the_other() {
        let (now, most) = (AtomicU64::new(0), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for _ in 0..8 {
                scope.spawn(|| {
                    let _room = Room::take(ALL / 2 + 1);
                    most.fetch_max(now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                    std::thread::sleep(std::time::Duration::from_millis(2));
                    now.fetch_sub(1, Ordering::SeqCst);
                });
            }
        });
        assert_eq!(most.into_inner(), 1);
        drop(Room::take(u64::MAX)); // alone, whatever its size
    }
}
