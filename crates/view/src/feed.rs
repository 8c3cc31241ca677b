//! What the solver has last said, for however many pages that ask: the newest light, the state of the solve; and what
//! pages ask for, a pause.

use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use serde_json::Value;

/// A numbered message.
#[derive(Clone, Debug)]
pub struct Message {
    /// Rises with every message of either kind.
    pub number: u64,
    /// A container of [`crate::light`].
    pub bytes: Arc<Vec<u8>>,
}

#[derive(Debug, Default)]
struct State {
    light: Option<Message>,
    samples: Option<Message>,
    status: Value,
    paused: bool,
    closed: bool,
    numbers: u64,
}

/// The exchange between a solve and the server.
#[derive(Debug, Default)]
pub struct Feed {
    state: Mutex<State>,
    changed: Condvar,
}

impl Feed {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Whoever panicked left whole messages behind.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// New light, which replaces what was there.
    pub fn send_light(&self, bytes: Vec<u8>) {
        let mut state = self.lock();
        state.numbers += 1;
        state.light = Some(Message { number: state.numbers, bytes: Arc::new(bytes) });
        state.samples = None;
        self.changed.notify_all();
    }

    /// New samples.
    pub fn send_samples(&self, bytes: Vec<u8>) {
        let mut state = self.lock();
        state.numbers += 1;
        state.samples = Some(Message { number: state.numbers, bytes: Arc::new(bytes) });
        self.changed.notify_all();
    }

    /// What there is to say of the solve: an object.
    pub fn send_status(&self, status: Value) {
        self.lock().status = status;
        self.changed.notify_all();
    }

    /// The last status.
    pub fn status(&self) -> Value {
        self.lock().status.clone()
    }

    /// The light if it is newer than `after`, else samples if they are; waits up to `patience`.
    pub fn next(&self, after: u64, patience: Duration) -> Option<Message> {
        let end = Instant::now() + patience;
        let mut state = self.lock();
        loop {
            let newer = [&state.light, &state.samples].into_iter().flatten().find(|m| m.number > after);
            if let Some(message) = newer {
                return Some(message.clone());
            }
            let left = end.saturating_duration_since(Instant::now());
            if left.is_zero() || state.closed {
                return None;
            }
            state = self.changed.wait_timeout(state, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }

    /// Asks the solver to rest, or to go on.
    pub fn pause(&self, paused: bool) {
        self.lock().paused = paused;
        self.changed.notify_all();
    }

    /// Whether a page has asked it to rest.
    pub fn is_paused(&self) -> bool {
        self.lock().paused
    }

    /// Waits while a page wants the solver to rest, for so long at most.
    pub fn rest(&self, patience: Duration) {
        let state = self.lock();
        if state.paused && !state.closed {
            drop(self.changed.wait_timeout(state, patience).unwrap_or_else(PoisonError::into_inner));
        }
    }

    /// Nobody waits any longer.
    pub fn close(&self) {
        self.lock().closed = true;
        self.changed.notify_all();
    }

    /// Whether it was closed.
    pub fn is_closed(&self) -> bool {
        self.lock().closed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOW: Duration = Duration::ZERO;

    #[test]
    fn light_goes_before_samples_and_nothing_comes_twice() {
        let feed = Feed::default();
        assert!(feed.next(0, NOW).is_none());
        feed.send_light(vec![1]);
        feed.send_samples(vec![2]);
        let light = feed.next(0, NOW).unwrap();
        assert_eq!((light.number, &light.bytes[..]), (1, &[1][..]));
        let samples = feed.next(1, NOW).unwrap();
        assert_eq!((samples.number, &samples.bytes[..]), (2, &[2][..]));
        assert!(feed.next(2, NOW).is_none());
        feed.send_light(vec![3]);
        assert_eq!(&feed.next(2, NOW).unwrap().bytes[..], &[3]);
        assert!(feed.next(3, NOW).is_none(), "samples older than a light are gone");
    }

    #[test]
    fn whoever_waits_is_woken() {
        let feed = Arc::new(Feed::default());
        let waiter = std::thread::spawn({
            let feed = feed.clone();
            move || feed.next(0, Duration::from_secs(60)).map(|m| m.number)
        });
        feed.send_light(vec![1]);
        assert_eq!(waiter.join().unwrap(), Some(1));
    }
}
