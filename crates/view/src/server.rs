//! The local server: loopback only, behind a random token, for pages that it served itself.
//!
//! Every address begins with the token, which other programs and other users' pages cannot guess; the host must be the
//! loopback's, so that no name that was pointed here reaches it (DNS rebinding); whatever a browser marks as coming from
//! another origin is refused. Requests for new light wait until there is some.

use std::io::{self, BufRead, BufReader, Write};
use std::net::{Ipv4Addr, Shutdown, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use crate::feed::Feed;
use crate::page;

/// How long a request for light waits.
const PATIENCE: Duration = Duration::from_secs(20);
/// Connections at once, at most; more are closed.
const MOST_CONNECTIONS: usize = 256;
/// Bytes of a request at most, and how many headers.
const MOST_BYTES: u64 = 32_768;
const MOST_HEADERS: usize = 64;
/// How long the listener rests where it got no connection.
const PAUSE: Duration = Duration::from_millis(50);
/// How long a connection may be idle.
const IDLE: Duration = Duration::from_secs(60);

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
        let fail = |e: io::Error| ServerError::Port { port, reason: e.to_string() };
        let sockets = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(fail)?;
        let address = sockets.local_addr().map_err(fail)?;
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", address.port()));
        let (connections, ended) = (AtomicUsize::new(0), AtomicBool::new(false));
        let server = Arc::new(Inner { site, token, hosts, connections, ended });
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
        let (counted, server) = (server.clone(), server.clone());
        if server.connections.fetch_add(1, Ordering::SeqCst) < MOST_CONNECTIONS {
            let serving = std::thread::Builder::new().spawn(move || {
                // Whoever goes away, or sends what is no request, gets no answer.
                drop(server.serve(&connection));
                drop(connection.shutdown(Shutdown::Both));
                server.connections.fetch_sub(1, Ordering::SeqCst);
            });
            if serving.is_err() {
                counted.connections.fetch_sub(1, Ordering::SeqCst);
            }
        } else {
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
    fn write(&self, mut to: impl Write) -> io::Result<()> {
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
        to.write_all(head.as_bytes())?;
        to.write_all(&self.body)?;
        to.flush()
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
    Answer { status, ..with(body, "text/plain; charset=utf-8", &[]) }
}

impl Inner {
    /// Answers whatever a connection asks, until it ends.
    fn serve(&self, connection: &TcpStream) -> io::Result<()> {
        connection.set_read_timeout(Some(IDLE))?;
        connection.set_write_timeout(Some(IDLE))?;
        connection.set_nodelay(true)?;
        let mut reader = BufReader::new(connection);
        while let Some(request) = Request::read(&mut reader)? {
            self.response(&request).write(connection)?;
            if self.ended.load(Ordering::SeqCst) {
                break;
            }
        }
        Ok(())
    }

    fn response(&self, request: &Request) -> Answer {
        if !request.header("Host").is_some_and(|h| self.hosts.iter().any(|ours| ours == h)) {
            return plain(403, "this server is for 127.0.0.1 alone");
        }
        let ours = |origin: &str| self.hosts.iter().any(|h| origin == format!("http://{h}"));
        let foreign_origin = request.header("Origin").is_some_and(|o| !ours(o));
        let foreign_site = request.header("Sec-Fetch-Site").is_some_and(|s| !matches!(s, "same-origin" | "none"));
        // A link to the page may stand anywhere: whoever follows it knows the token, and nobody else sees what comes.
        let is_link = request.method == "GET"
            && request.header("Sec-Fetch-Mode") == Some("navigate")
            && request.header("Sec-Fetch-Dest") == Some("document");
        if foreign_origin || foreign_site && !is_link {
            return plain(403, "this server is for its own page alone");
        }
        let (path, query) = request.target.split_once('?').unwrap_or((&request.target, ""));
        let mut parts = path.trim_start_matches('/').splitn(2, '/');
        let (token, rest) = (parts.next().unwrap_or(""), parts.next());
        if !equal(token, &self.token) {
            return plain(403, "the address lacks the token: take the whole line that twinray printed");
        }
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
    use std::io::Read;

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

    #[test]
    fn a_taken_port_is_told() {
        let first = server();
        let site = Site { name: String::new(), scene: Arc::default(), feed: Arc::default() };
        let error = Running::start(site, first.address.port(), TOKEN.to_owned()).unwrap_err().to_string();
        assert!(error.contains("leave --port out"), "{error}");
    }
}
