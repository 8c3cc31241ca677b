//! Connections of the local server and how long they may take: whoever shows no token holds nothing for long.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{Shutdown, TcpStream};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// How long what may take.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Limits {
    /// The head of a request from its first byte on, and the first one of a connection from its opening on: as a whole, since
    /// a byte now and then would make any limit of a single read endless.
    pub head: Duration,
    /// Between two requests of a connection that has shown the token.
    pub idle: Duration,
    /// Until the other side has taken the next [`CHUNK`] of an answer.
    pub stall: Duration,
}

impl Default for Limits {
    fn default() -> Self {
        let [head, idle, stall] = [5, 60, 10].map(Duration::from_secs);
        Self { head, idle, stall }
    }
}

/// Bytes that a reader has to take within [`Limits::stall`]: any network does, also one that a tunnel leads through.
pub(crate) const CHUNK: usize = 65_536;

/// A socket whose reads and writes end at a time.
#[derive(Debug)]
pub(crate) struct Timed<'a> {
    socket: &'a TcpStream,
    until: Instant,
}

impl<'a> Timed<'a> {
    pub fn new(socket: &'a TcpStream, time: Duration) -> Self {
        Self { socket, until: Instant::now() + time }
    }

    /// All that follows has to be over after this time.
    pub fn within(&mut self, time: Duration) {
        self.until = Instant::now() + time;
    }

    fn left(&self) -> io::Result<Option<Duration>> {
        let left = self.until.saturating_duration_since(Instant::now());
        if left.is_zero() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(Some(left)) }
    }
}

impl Read for Timed<'_> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.socket.set_read_timeout(self.left()?)?;
        self.socket.read(buffer)
    }
}

impl Write for Timed<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.socket.set_write_timeout(self.left()?)?;
        self.socket.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.socket.flush()
    }
}

/// Writes all of an answer to a reader that goes on reading.
pub(crate) fn write_steadily(socket: &TcpStream, bytes: &[u8], stall: Duration) -> io::Result<()> {
    bytes.chunks(CHUNK).try_for_each(|chunk| Timed::new(socket, stall).write_all(chunk))
}

/// Connections that have not shown the token yet, the oldest first.
#[derive(Debug, Default)]
pub(crate) struct Guests {
    list: Mutex<VecDeque<Arc<TcpStream>>>,
}

impl Guests {
    fn list(&self) -> MutexGuard<'_, VecDeque<Arc<TcpStream>>> {
        // A list is whole whatever a thread was about that panicked.
        self.list.lock().unwrap_or_else(PoisonError::into_inner)
    }

    pub fn enter(&self, socket: &Arc<TcpStream>) {
        self.list().push_back(socket.clone());
    }

    /// Of one that has shown the token, or has ended.
    pub fn leave(&self, socket: &Arc<TcpStream>) {
        self.list().retain(|s| !Arc::ptr_eq(s, socket));
    }

    /// Ends the one that has waited longest, so that another gets its chance; false if there is none.
    pub fn make_room(&self) -> bool {
        let oldest = self.list().pop_front();
        // If the other side has ended it already, so much the better.
        oldest.map(|socket| drop(socket.shutdown(Shutdown::Both))).is_some()
    }
}
