//! The local server: loopback only, behind a random token, for pages that it served itself.
//!
//! Every address begins with the token, which other programs and other users' pages cannot guess; the host must be the
//! loopback's, so that no name that was pointed here reaches it (DNS rebinding); whatever a browser marks as coming from
//! another origin is refused. Requests for new light wait until there is some. Connections that show no token are ended
//! soon, and at once where others need their place.

use std::io::{self, BufRead, BufReader};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::connection::{Guests, Limits, Timed, write_steadily};
use crate::feed::Feed;
use crate::page;

/// How long a request for light waits.
const PATIENCE: Duration = Duration::from_secs(20);
/// Connections at once, at most. For one more, the oldest goes that has not shown the token; without such a one it is closed.
const MOST_CONNECTIONS: usize = 256;
/// The same with those that were told to go and have not gone yet.
const MOST_THREADS: usize = 2 * MOST_CONNECTIONS;
/// Bytes of a request at most, and how many headers.
const MOST_BYTES: u64 = 32_768;
const MOST_HEADERS: usize = 64;
/// How long the listener rests where it got no connection.
const PAUSE: Duration = Duration::from_millis(50);

/// Why there is no server.
#[derive(Debug, thiserror::Error)]
pub enum ServerError {
    /// The port is taken, or not ours to take.
    #[error("127.0.0.1:{port}: {reason}: another program may have the port; leave --port out and a free one is found")]
    Port {
        /// What was asked for.
        port: u16,
        /// What the system says.
        reason: String,
    },
    /// The system gives no random numbers.
    #[error("no random numbers for the token: {0}")]
    Token(String),
}

/// What is served.
#[derive(Debug)]
pub struct Site {
    /// Name of the scene.
    pub name: String,
    /// Its bytes, [`crate::package`].
    pub scene: Arc<Vec<u8>>,
    /// The light and the solve.
    pub feed: Arc<Feed>,
}

/// A running server; it ends when it is dropped.
#[derive(Debug)]
pub struct Running {
    server: Arc<Inner>,
    address: SocketAddr,
    listener: Option<JoinHandle<()>>,
}

struct Inner {
    site: Site,
    token: String,
    hosts: [String; 2],
    connections: AtomicUsize,
    guests: Guests,
    limits: Limits,
    ended: AtomicBool,
}

impl std::fmt::Debug for Inner {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        // The token is nobody's business.
        f.debug_struct("Inner").field("hosts", &self.hosts).finish_non_exhaustive()
    }
}

/// A token of 128 random bits.
///
/// # Errors
/// If the system gives no random numbers.
pub fn token() -> Result<String, ServerError> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(|e| ServerError::Token(e.to_string()))?;
    Ok(bytes.iter().map(|b| format!("{b:02x}")).collect())
}

impl Running {
    /// Starts on a port of 127.0.0.1; 0 finds a free one.
    ///
    /// # Errors
    /// If the port cannot be had.
    pub fn start(site: Site, port: u16, token: String) -> Result<Self, ServerError> {
        Self::start_with(site, port, token, Limits::default())
    }

    fn start_with(site: Site, port: u16, token: String, limits: Limits) -> Result<Self, ServerError> {
        let fail = |e: io::Error| ServerError::Port { port, reason: e.to_string() };
        let sockets = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(fail)?;
        let address = sockets.local_addr().map_err(fail)?;
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", address.port()));
        let (connections, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
        let guests = Guests::default();
        let server = Arc::new(Inner { site, token, hosts, connections, guests, limits, ended });
        let listener = std::thread::spawn({
            let server = server.clone();
            move || listen(&sockets, &server)
        });
        Ok(Self { server, address, listener: Some(listener) })
    }

    /// Where the page is.
    pub fn url(&self) -> String {
        format!("http://{}/{}/", self.address, self.server.token)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.server.ended.store(true, Ordering::SeqCst);
        self.server.site.feed.close();
        // The listener waits for a connection; this one it does not serve any more.
        drop(TcpStream::connect(self.address));
        if let Some(listener) = self.listener.take() {
            // It ends by itself; whether it panicked changes nothing any more.
            drop(listener.join());
        }
    }
}

/// A thread for each connection: there are few, and those that ask for light wait.
fn listen(sockets: &TcpListener, server: &Arc<Inner>) {
    for connection in sockets.incoming() {
        if server.ended.load(Ordering::SeqCst) {
            return;
        }
        let Ok(connection) = connection else {
            // The other side's matter; or there are no more descriptors, which takes time to mend.
            std::thread::sleep(PAUSE);
            continue;
        };
        let before = server.connections.fetch_add(1, Ordering::SeqCst);
        if before >= MOST_THREADS || before >= MOST_CONNECTIONS && !server.guests.make_room() {
            server.connections.fetch_sub(1, Ordering::SeqCst);
            continue;
        }
        let (connection, serving) = (Arc::new(connection), server.clone());
        server.guests.enter(&connection);
        let thread = std::thread::Builder::new().spawn({
            let connection = connection.clone();
            move || {
                // Whoever goes away, or sends what is no request, gets no answer.
                drop(serving.serve(&connection));
                drop(connection.shutdown(Shutdown::Both));
                serving.guests.leave(&connection);
                serving.connections.fetch_sub(1, Ordering::SeqCst);
            }
        });
        if thread.is_err() {
            server.guests.leave(&connection);
            server.connections.fetch_sub(1, Ordering::SeqCst);
        }
    }
}

/// What is asked.
struct Request {
    method: String,
    target: String,
    headers: Vec<(String, String)>,
}

impl Request {
    /// Reads one; `None` at the end of a connection.
    fn read(from: &mut impl BufRead) -> io::Result<Option<Self>> {
        let mut head = Vec::new();
        let mut limited = io::Read::take(from, MOST_BYTES);
        loop {
            let before = head.len();
            if limited.read_until(b'\n', &mut head)? == 0 {
                return if head.is_empty() { Ok(None) } else { Err(io::ErrorKind::UnexpectedEof.into()) };
            }
            if matches!(&head[before..], b"\r\n" | b"\n") && before > 0 {
                break;
            }
        }
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        let complete = request.parse(&head).map_err(|e| io::Error::new(io::ErrorKind::InvalidData, e))?.is_complete();
        let (Some(method), Some(target), true) = (request.method, request.path, complete) else {
            return Err(io::ErrorKind::InvalidData.into());
        };
        let header = |h: &httparse::Header| (h.name.to_owned(), String::from_utf8_lossy(h.value).into_owned());
        let (method, target) = (method.to_owned(), target.to_owned());
        let this = Self { method, target, headers: request.headers.iter().map(header).collect() };
        // No question of the page has a body; what follows would be taken for the next one.
        match this.header("Content-Length").is_none_or(|n| n == "0") && this.header("Transfer-Encoding").is_none() {
            true => Ok(Some(this)),
            false => Err(io::ErrorKind::InvalidData.into()),
        }
    }

    /// The token, what stands behind it, and the query.
    fn parts(&self) -> (&str, Option<&str>, &str) {
        let (path, query) = self.target.split_once('?').unwrap_or((&self.target, ""));
        let mut parts = path.trim_start_matches('/').splitn(2, '/');
        (parts.next().unwrap_or(""), parts.next(), query)
    }

    fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(n, _)| n.eq_ignore_ascii_case(name)).map(|(_, value)| value.as_str())
    }
}

/// What is answered.
struct Answer {
    status: u16,
    headers: Vec<(&'static str, String)>,
    body: Arc<Vec<u8>>,
}

impl Answer {
    fn write(&self, to: &TcpStream, stall: Duration) -> io::Result<()> {
        let reason = match self.status {
            200 => "OK",
            204 => "No Content",
            308 => "Permanent Redirect",
            403 => "Forbidden",
            404 => "Not Found",
            405 => "Method Not Allowed",
            _ => "Internal Server Error",
        };
        let mut head = format!("HTTP/1.1 {} {reason}\r\n", self.status);
        for (name, value) in &self.headers {
            head += &format!("{name}: {value}\r\n");
        }
        if self.status != 204 {
            head += &format!("Content-Length: {}\r\n", self.body.len());
        }
        head += "\r\n";
        write_steadily(to, head.as_bytes(), stall)?;
        write_steadily(to, &self.body, stall)
    }
}

fn with(body: impl Into<Arc<Vec<u8>>>, kind: &str, more: &[(&'static str, &str)]) -> Answer {
    let common = [
        ("Content-Type", kind),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Cross-Origin-Opener-Policy", "same-origin"),
    ];
    let headers = common.iter().chain(more).map(|(name, value)| (*name, (*value).to_owned())).collect();
    Answer { status: 200, headers, body: body.into() }
}

fn plain(status: u16, text: &str) -> Answer {
    let body = if text.is_empty() { Vec::new() } else { format!("{text}\n").into_bytes() };
    let more: &[_] = if status == 403 { &[("Connection", "close")] } else { &[] };
    Answer { status, ..with(body, "text/plain; charset=utf-8", more) }
}

impl Inner {
    /// Answers whatever a connection asks, until it ends.
    fn serve(&self, connection: &Arc<TcpStream>) -> io::Result<()> {
        let Limits { head, idle, stall } = self.limits;
        connection.set_nodelay(true)?;
        let mut reader = BufReader::new(Timed::new(connection, head));
        while let Some(request) = Request::read(&mut reader)? {
            if let Some(refusal) = self.refusal(&request) {
                // Whoever is refused has nothing more to ask here.
                return refusal.write(connection, stall);
            }
            self.guests.leave(connection);
            self.response(&request).write(connection, stall)?;
            if self.ended.load(Ordering::SeqCst) {
                break;
            }
            reader.get_mut().within(idle);
            if reader.fill_buf()?.is_empty() {
                break;
            }
            reader.get_mut().within(head);
        }
        Ok(())
    }

    /// Why a request gets nothing; `None` for one of the page.
    fn refusal(&self, request: &Request) -> Option<Answer> {
        if !request.header("Host").is_some_and(|h| self.hosts.iter().any(|ours| ours == h)) {
            return Some(plain(403, "this server is for 127.0.0.1 alone"));
        }
        let ours = |origin: &str| self.hosts.iter().any(|h| origin == format!("http://{h}"));
        let foreign_origin = request.header("Origin").is_some_and(|o| !ours(o));
        let foreign_site = request.header("Sec-Fetch-Site").is_some_and(|s| !matches!(s, "same-origin" | "none"));
        // A link to the page may stand anywhere: whoever follows it knows the token, and nobody else sees what comes.
        let is_link = request.method == "GET"
            && request.header("Sec-Fetch-Mode") == Some("navigate")
            && request.header("Sec-Fetch-Dest") == Some("document");
        if foreign_origin || foreign_site && !is_link {
            return Some(plain(403, "this server is for its own page alone"));
        }
        let (token, ..) = request.parts();
        let refused = !equal(token, &self.token);
        refused.then(|| plain(403, "the address lacks the token: take the whole line that twinray printed"))
    }

    /// What a request of the page gets.
    fn response(&self, request: &Request) -> Answer {
        let (_, rest, query) = request.parts();
        let feed = &self.site.feed;
        match (request.method.as_str(), rest) {
            ("GET", None) => {
                let place = format!("/{}/", self.token);
                Answer { status: 308, ..with(Vec::new(), "text/plain", &[("Location", &place)]) }
            }
            ("GET", Some("")) => self.page(),
            ("GET", Some("style.css")) => with(page::STYLE.as_bytes().to_vec(), "text/css; charset=utf-8", &[]),
            ("GET", Some("scene")) => with(self.site.scene.clone(), "application/octet-stream", &[]),
            ("GET", Some("status")) => with(feed.status().to_string().into_bytes(), "application/json", &[]),
            ("GET", Some("light")) => {
                let after = query.strip_prefix("after=").and_then(|n| n.parse().ok()).unwrap_or(0);
                match feed.next(after, PATIENCE) {
                    Some(message) => {
                        let number = message.number.to_string();
                        with(message.bytes, "application/octet-stream", &[("X-Number", &number)])
                    }
                    None => plain(204, ""),
                }
            }
            ("POST", Some(wish @ ("pause" | "resume"))) => {
                feed.pause(wish == "pause");
                with(b"{}".to_vec(), "application/json", &[])
            }
            ("GET", Some(name)) => match page::MODULES.iter().find(|(n, _)| *n == name) {
                Some((_, text)) => with(text.as_bytes().to_vec(), "text/javascript; charset=utf-8", &[]),
                None => plain(404, "no such file"),
            },
            _ => plain(405, "only what the page asks for"),
        }
    }

    fn page(&self) -> Answer {
        let Ok(nonce) = token() else { return plain(500, "no random numbers") };
        let policy = format!(
            "default-src 'none'; script-src 'self' 'nonce-{nonce}'; style-src 'self'; img-src 'self' data: blob:; \
             connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
        );
        let html = page::served(&self.site.name, &nonce).into_bytes();
        with(html, "text/html; charset=utf-8", &[("Content-Security-Policy", &policy)])
    }
}

/// Equality that takes as long whatever differs.
fn equal(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |d, (x, y)| d | (x ^ y)) == 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    const TOKEN: &str = "0123456789abcdef";

    fn server() -> Running {
        let site = Site { name: "test".to_owned(), scene: Arc::new(vec![7; 9]), feed: Arc::default() };
        Running::start(site, 0, TOKEN.to_owned()).unwrap()
    }

    fn connected(server: &Running, request: &str) -> TcpStream {
        let mut connection = TcpStream::connect(server.address).unwrap();
        connection.write_all(request.replace("HOST", &server.address.to_string()).as_bytes()).unwrap();
        connection
    }

    /// Status of an answer; 0 if there is none.
    fn status(server: &Running, request: &str) -> u16 {
        let mut text = [0; 12];
        match connected(server, request).read_exact(&mut text) {
            Ok(()) => String::from_utf8_lossy(&text[9..]).parse().unwrap(),
            Err(_) => 0,
        }
    }

    #[test]
    fn only_the_page_is_answered() {
        let server = server();
        let get = |target: &str, more: &str| format!("GET {target} HTTP/1.1\r\nHost: HOST\r\n{more}\r\n");
        let ours = |file: &str| format!("/{TOKEN}/{file}");
        for (request, expected) in [
            (get(&ours(""), ""), 200),
            (get(&ours("main.js"), "Sec-Fetch-Site: same-origin\r\n"), 200),
            (get(&ours("scene"), ""), 200),
            (get(&format!("/{TOKEN}"), ""), 308),
            (get(&ours("../Cargo.toml"), ""), 404),
            (get("/", ""), 403),
            (get("/0123456789abcdeX/", ""), 403),
            (get(&ours(""), "Origin: http://elsewhere.example\r\n"), 403),
            (get(&ours("scene"), "Sec-Fetch-Site: cross-site\r\n"), 403),
            (
                get(
                    &ours(""),
                    "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: document\r\n",
                ),
                200,
            ),
            (
                get(&ours(""), "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\nSec-Fetch-Dest: iframe\r\n"),
                403,
            ),
            (get(&ours(""), "").replace("HOST", "elsewhere.example"), 403),
            (get(&ours(""), "").replace("Host: HOST\r\n", ""), 403),
            (get(&ours("pause"), "").replace("GET", "PUT"), 405),
            (get(&ours("pause"), "Content-Length: 0\r\n").replace("GET", "POST"), 200),
            (get(&ours("pause"), "Content-Length: 3\r\n").replace("GET", "POST") + "abc", 0),
            ("nonsense\r\n\r\n".to_owned(), 0),
            (get(&ours(""), &"X: y\r\n".repeat(100)), 0),
        ] {
            assert_eq!(status(&server, &request), expected, "{request}");
        }
        assert!(server.server.site.feed.is_paused());
    }

    #[test]
    fn whoever_waits_for_light_keeps_nobody_from_it() {
        let server = server();
        let waiting = format!("GET /{TOKEN}/light?after=0 HTTP/1.1\r\nHost: HOST\r\n\r\n");
        let mut waiters: Vec<TcpStream> = (0..20).map(|_| connected(&server, &waiting)).collect();
        // A page's modules come over several connections at once.
        let module = format!("GET /{TOKEN}/vec.js HTTP/1.1\r\nHost: HOST\r\n\r\n");
        let mut modules: Vec<TcpStream> = (0..20).map(|_| connected(&server, &module)).collect();
        let mut line = [0; 12];
        for connection in &mut modules {
            connection.read_exact(&mut line).unwrap();
            assert_eq!(&line, b"HTTP/1.1 200");
        }
        server.server.site.feed.send_light(vec![1, 2, 3]);
        for connection in &mut waiters {
            connection.read_exact(&mut line).unwrap();
            assert_eq!(&line, b"HTTP/1.1 200");
        }
    }

    #[test]
    fn one_connection_asks_again_and_again() {
        let server = server();
        let mut connection = TcpStream::connect(server.address).unwrap();
        let request = format!("GET /{TOKEN}/scene HTTP/1.1\r\nHost: {}\r\n\r\n", server.address);
        for _ in 0..3 {
            connection.write_all(request.as_bytes()).unwrap();
            let mut reader = BufReader::new(&connection);
            let (mut line, mut length) = (String::new(), 0);
            while reader.read_line(&mut line).unwrap() > 2 {
                length = line.strip_prefix("Content-Length: ").map_or(length, |n| n.trim().parse().unwrap());
                line.clear();
            }
            let mut body = vec![0; length];
            reader.read_exact(&mut body).unwrap();
            assert_eq!(body, [7; 9]);
        }
    }

    const MODULE: &str = "GET /0123456789abcdef/vec.js HTTP/1.1\r\nHost: HOST\r\n\r\n";

    /// A server whose limits a test can wait for.
    fn hasty(scene: usize, limits: Limits) -> Running {
        let site = Site { name: "test".to_owned(), scene: Arc::new(vec![7; scene]), feed: Arc::default() };
        Running::start_with(site, 0, TOKEN.to_owned(), limits).unwrap()
    }

    /// Long enough that nothing is ended by it in a test.
    const LONG: Duration = Duration::from_secs(3600);

    /// Until the server has ended the connection: what came before that, for a reader that reads.
    fn rest_of(mut connection: &TcpStream) -> Vec<u8> {
        let (mut all, mut bytes) = (Vec::new(), [0; 4096]);
        // A reset is an end like another.
        while let Ok(n @ 1..) = connection.read(&mut bytes) {
            all.extend(&bytes[..n]);
        }
        all
    }

    /// Until no connection is served any more.
    fn empty(server: &Running) {
        while server.server.connections.load(Ordering::SeqCst) > 0 {
            std::thread::sleep(PAUSE);
        }
    }

    #[test]
    fn a_head_that_never_ends_does_not_hold_its_place() {
        let server = hasty(9, Limits { head: Duration::from_millis(300), idle: LONG, stall: LONG });
        // One says nothing, one a byte now and then, which starts no limit anew.
        let silent = TcpStream::connect(server.address).unwrap();
        let mut slow = TcpStream::connect(server.address).unwrap();
        while slow.write_all(b"G").is_ok() {
            std::thread::sleep(Duration::from_millis(20));
        }
        assert_eq!(rest_of(&silent), b"");
        // The same for the second request of one that has shown the token.
        let mut known = connected(&server, MODULE);
        known.read_exact(&mut [0; 12]).unwrap();
        known.write_all(b"GET /").unwrap();
        assert!(!rest_of(&known).is_empty());
        empty(&server);
    }

    #[test]
    fn idle_connections_do_not_lock_out_the_page() {
        // No deadline helps here: the page gets the place of a silent one.
        let server = hasty(9, Limits { head: LONG, idle: LONG, stall: LONG });
        let silent: Vec<TcpStream> =
            (0..MOST_CONNECTIONS + 20).map(|_| TcpStream::connect(server.address).unwrap()).collect();
        assert_eq!(status(&server, MODULE), 200);
        assert_eq!(rest_of(&silent[0]), b"", "the oldest went");
        assert_eq!(status(&server, &MODULE.replace(TOKEN, "nonsense")), 403);
        assert_eq!(status(&server, MODULE), 200);
    }

    #[test]
    fn whoever_has_shown_the_token_keeps_its_place() {
        let server = hasty(9, Limits { head: LONG, idle: LONG, stall: LONG });
        let mut known = connected(&server, MODULE);
        known.read_exact(&mut [0; 12]).unwrap();
        let _silent: Vec<TcpStream> =
            (0..MOST_CONNECTIONS + 20).map(|_| TcpStream::connect(server.address).unwrap()).collect();
        assert_eq!(status(&server, MODULE), 200);
        let request = MODULE.replace("HOST", &server.address.to_string()).replace("vec.js", "nothing.js");
        known.write_all(request.as_bytes()).unwrap();
        let mut text = Vec::new();
        while !text.ends_with(b"404 Not Found") {
            let mut byte = [0];
            known.read_exact(&mut byte).unwrap();
            text.push(byte[0]);
        }
    }

    #[test]
    fn a_refused_connection_is_ended() {
        let server = hasty(9, Limits { head: LONG, idle: LONG, stall: LONG });
        let answer = rest_of(&connected(&server, &MODULE.replace(TOKEN, "nonsense")));
        assert!(String::from_utf8_lossy(&answer).contains("Connection: close"));
        empty(&server);
    }

    #[test]
    fn a_reader_that_does_not_read_is_left_and_one_that_reads_slowly_gets_all() {
        // More than sockets keep for a reader.
        let scene = 64 << 20;
        let server = hasty(scene, Limits { head: LONG, idle: LONG, stall: Duration::from_secs(2) });
        let request = MODULE.replace("vec.js", "scene");
        let mut unread = connected(&server, &request);
        // It is served from here on.
        unread.read_exact(&mut [0; 12]).unwrap();
        empty(&server);
        assert!(rest_of(&unread).len() < scene);
        let mut slow = connected(&server, &request);
        let mut part = vec![0; scene / 16];
        for _ in 0..16 {
            slow.read_exact(&mut part).unwrap();
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    #[test]
    fn a_taken_port_is_told() {
        let first = server();
        let site = Site { name: String::new(), scene: Arc::default(), feed: Arc::default() };
        let error = Running::start(site, first.address.port(), TOKEN.to_owned()).unwrap_err().to_string();
        assert!(error.contains("leave --port out"), "{error}");
    }
}
