//! The local server: loopback only, behind a random token, for pages that it served itself.
//!
//! Every address begins with the token, which other programs and other users' pages cannot guess; the host must be the
//! loopback's, so that no name that was pointed here reaches it (DNS rebinding); whatever a browser marks as coming from
//! another origin is refused. Requests for new light wait until there is some.

use std::io::Cursor;
use std::net::{Ipv4Addr, SocketAddr};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;

use tiny_http::{Header, Method, Request, Response, Server};

use crate::feed::Feed;
use crate::page;

/// How long a request for light waits.
const PATIENCE: Duration = Duration::from_secs(20);
/// Requests that are answered at once, at most; more are refused.
const MOST_REQUESTS: usize = 64;

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
    pub scene: Vec<u8>,
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
    http: Server,
    site: Site,
    token: String,
    hosts: [String; 2],
    busy: AtomicUsize,
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
        let fail = |reason: String| ServerError::Port { port, reason };
        let http = Server::http((Ipv4Addr::LOCALHOST, port)).map_err(|e| fail(e.to_string()))?;
        let address = http.server_addr().to_ip().ok_or_else(|| fail("no address".to_owned()))?;
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{}", address.port()));
        let server = Arc::new(Inner { http, site, token, hosts, busy: AtomicUsize::new(0) });
        let listener = std::thread::spawn({
            let server = server.clone();
            move || {
                for request in server.http.incoming_requests() {
                    let server = server.clone();
                    if server.busy.fetch_add(1, Ordering::SeqCst) >= MOST_REQUESTS {
                        answer(request, plain(503, "too many requests"));
                        server.busy.fetch_sub(1, Ordering::SeqCst);
                        continue;
                    }
                    std::thread::spawn(move || {
                        let response = server.response(&request);
                        answer(request, response);
                        server.busy.fetch_sub(1, Ordering::SeqCst);
                    });
                }
            }
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
        self.server.site.feed.close();
        self.server.http.unblock();
        if let Some(listener) = self.listener.take() {
            // It ends by itself; whether it panicked changes nothing any more.
            drop(listener.join());
        }
    }
}

type Answer = Response<Cursor<Vec<u8>>>;

fn answer(request: Request, response: Answer) {
    // Whoever has gone away gets no answer.
    drop(request.respond(response));
}

fn header(name: &str, value: &str) -> Option<Header> {
    Header::from_bytes(name, value).ok()
}

fn with(bytes: Vec<u8>, kind: &str, more: &[(&str, &str)]) -> Answer {
    let common = [
        ("Content-Type", kind),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
        ("Referrer-Policy", "no-referrer"),
        ("Cross-Origin-Resource-Policy", "same-origin"),
        ("Cross-Origin-Opener-Policy", "same-origin"),
    ];
    let mut response = Response::from_data(bytes);
    for header in common.iter().chain(more).filter_map(|(name, value)| header(name, value)) {
        response.add_header(header);
    }
    response
}

fn plain(status: u16, text: &str) -> Answer {
    with(format!("{text}\n").into_bytes(), "text/plain; charset=utf-8", &[]).with_status_code(status)
}

impl Inner {
    fn response(&self, request: &Request) -> Answer {
        let of = |name: &'static str| {
            request.headers().iter().find(|h| h.field.equiv(name)).map(|h| h.value.as_str().to_owned())
        };
        let host = of("Host");
        if !host.as_ref().is_some_and(|h| self.hosts.contains(h)) {
            return plain(403, "this server is for 127.0.0.1 alone");
        }
        let foreign_origin = of("Origin").is_some_and(|o| !self.hosts.iter().any(|h| o == format!("http://{h}")));
        let foreign_site = of("Sec-Fetch-Site").is_some_and(|s| !matches!(s.as_str(), "same-origin" | "none"));
        if foreign_origin || foreign_site {
            return plain(403, "this server is for its own page alone");
        }
        let (path, query) = request.url().split_once('?').unwrap_or((request.url(), ""));
        let mut parts = path.trim_start_matches('/').splitn(2, '/');
        let (token, rest) = (parts.next().unwrap_or(""), parts.next());
        if !equal(token, &self.token) {
            return plain(403, "the address lacks the token: take the whole line that twinray printed");
        }
        let feed = &self.site.feed;
        match (request.method(), rest) {
            (Method::Get, None) => {
                let place = format!("/{}/", self.token);
                with(Vec::new(), "text/plain", &[("Location", &place)]).with_status_code(308)
            }
            (Method::Get, Some("")) => self.page(),
            (Method::Get, Some("style.css")) => with(page::STYLE.into(), "text/css; charset=utf-8", &[]),
            (Method::Get, Some("scene")) => with(self.site.scene.clone(), "application/octet-stream", &[]),
            (Method::Get, Some("status")) => with(feed.status().to_string().into_bytes(), "application/json", &[]),
            (Method::Get, Some("light")) => {
                let after = query.strip_prefix("after=").and_then(|n| n.parse().ok()).unwrap_or(0);
                match feed.next(after, PATIENCE) {
                    Some(message) => {
                        let number = message.number.to_string();
                        let bytes = message.bytes.as_ref().clone();
                        with(bytes, "application/octet-stream", &[("X-Number", &number)])
                    }
                    None => plain(204, ""),
                }
            }
            (Method::Post, Some(wish @ ("pause" | "resume"))) => {
                feed.pause(wish == "pause");
                with(b"{}".to_vec(), "application/json", &[])
            }
            (Method::Get, Some(name)) => match page::MODULES.iter().find(|(n, _)| *n == name) {
                Some((_, text)) => with((*text).into(), "text/javascript; charset=utf-8", &[]),
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
