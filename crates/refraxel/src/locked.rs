//! What threads share.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The content of a mutex, also where a thread has panicked with it: a panic ends the whole program
/// ([`end_on_panic`](crate::exit::end_on_panic)).
pub fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
