//! The explorer's HTTP server, for the browser on this machine.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use http_body_util::{BodyExt, Limited};
use hyper::body::{Body, Bytes, Frame, Incoming, SizeHint};
use hyper::header::{self, HeaderMap, HeaderValue};
use hyper::service::service_fn;
use hyper::{Method, Request, Response, StatusCode};
use hyper_util::rt::{TokioIo, TokioTimer};
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::{Semaphore, mpsc};
use tokio::task::spawn_blocking;
use tokio::time::{interval, sleep, timeout};

use crate::error::Error;
use crate::explore::bakes::{Bakes, Order, typed};
use crate::explore::cache::Cache;
use crate::explore::charts::Charts;
use crate::explore::heap;
use crate::explore::page;
use crate::explore::queue::{Lane, Queue};
use crate::explore::request::{Failure, ReadRequest, Sender, Status, read};
use crate::explore::save_preset::save;
use crate::explore::search::Search;
use crate::explore::tiles::Studio;
use crate::explore::worlds::{FILE, Given, Opened, WorldRecipe, Worlds};
use crate::export::Profile;
use crate::generator;
use crate::map::style::STYLES;
use crate::memory::{Budget, Usage};
use crate::preset::{BUILT_IN, Preset, summary};
use crate::stop;

/// Largest number of connections at a time: a browser has six for each page. Further ones wait until one is free.
const CONNECTIONS: usize = 96;

/// Time in which a client must send its request, and for which a connection may be silent. An unused connection keeps
/// others waiting for at most this long.
const PATIENCE: Duration = Duration::from_secs(5);

/// Largest number of bytes of a request's body.
const MOST_BODY: usize = 1 << 16;

/// Interval at which the server checks whether the process is to end.
const LOOK_INTERVAL: Duration = Duration::from_millis(50);

/// Interval at which freed memory is given back to the system.
const GIVE_BACK_INTERVAL: Duration = Duration::from_secs(1);

/// Interval at which the preset's file is read again.
const FILE_INTERVAL: Duration = Duration::from_millis(500);

/// Number of threads for work that waits for the disk or for another program.
const BLOCKING: usize = 8;

/// Content security policy: the sources that the page may load anything from.
const POLICY: &str =
    "default-src 'self'; img-src 'self' data: blob:; style-src 'self' 'unsafe-inline'; frame-ancestors 'self'";

/// Settings of an explorer: the world that it shows first, and the resources that it may use.
#[derive(Clone, Debug)]
pub struct Options {
    /// The world that the page begins with.
    pub given: Given,
    /// The place that the page begins at, in metres east and north of the origin, and the metres that a pixel shows
    /// there; `None` leaves both to the page.
    pub view: Option<([f64; 2], f64)>,
    /// The port on 127.0.0.1; 0 for any free one.
    pub port: u16,
    /// The folder for drawn tiles, which several explorers may share; `None` keeps nothing on the disk.
    pub cache: Option<PathBuf>,
    /// Largest number of bytes that the files of this folder take.
    pub cached_bytes: u64,
    /// Largest number of bytes of memory that all worlds at all scales may remember.
    pub remembered_bytes: u64,
    /// The program that bakes are run with, as a command.
    pub program: PathBuf,
    /// Number of threads for glances and drafts, and again for full pictures.
    pub threads: usize,
}

/// An explorer that is ready to answer requests.
pub struct Server {
    listener: TcpListener,
    address: SocketAddr,
    runtime: Runtime,
    explorer: Arc<Explorer>,
}

/// The state of the explorer, which all requests share.
struct Explorer {
    view: Option<([f64; 2], f64)>,
    port: u16,
    worlds: Worlds,
    studio: Arc<Studio>,
    bakes: Bakes,
}

impl Server {
    /// Binds an explorer to the loopback address of this machine, which no other machine reaches.
    ///
    /// # Errors
    /// When something is wrong with the preset, the port is taken, or the folder for drawn tiles cannot be used.
    pub fn bind(options: Options) -> Result<Server, Error> {
        let Options { given, view, port, cache, cached_bytes, remembered_bytes, program, threads } = options;
        let budget = Budget::new(usize::try_from(remembered_bytes).unwrap_or(usize::MAX));
        let worlds = Worlds::new(given, budget);
        // Open the first world at once, so that a mistake in the preset is reported before there is a page.
        worlds.open(&worlds.first())?;
        let cannot = |error: std::io::Error| Error::Option {
            message: format!("port {port} of 127.0.0.1 cannot be had: {error}"),
            hint: "give another --port, or 0 for any that is free".into(),
        };
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).map_err(cannot)?;
        listener.set_nonblocking(true).map_err(cannot)?;
        let address = listener.local_addr().map_err(cannot)?;
        let runtime = Builder::new_current_thread().enable_io().enable_time().max_blocking_threads(BLOCKING).build();
        let cache = cache.map(|folder| Cache::open(&folder, cached_bytes)).transpose()?;
        let studio = Arc::new(Studio { charts: Charts::default(), cache, queue: Queue::start(threads)? });
        let explorer = Explorer { view, port: address.port(), worlds, studio, bakes: Bakes::new(program) };
        Ok(Server { listener, address, runtime: runtime.map_err(cannot)?, explorer: Arc::new(explorer) })
    }

    /// The address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Answers requests until all work of the process is [to end](stop).
    ///
    /// # Errors
    /// [`Error::Interrupted`] when the process is to end; another error when the system takes the port away.
    pub fn serve(self) -> Result<(), Error> {
        let Server { listener, runtime, explorer, .. } = self;
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener).map_err(Error::io("127.0.0.1"))?;
            tokio::spawn(explorer.clone().give_back());
            let free = Arc::new(Semaphore::new(CONNECTIONS));
            loop {
                let connection = async {
                    let place = free.clone().acquire_owned().await.expect("it is never closed");
                    (listener.accept().await, place)
                };
                if stop::is_requested() {
                    return Err(Error::Interrupted);
                }
                let Ok((accepted, place)) = timeout(LOOK_INTERVAL, connection).await else { continue };
                // The client has gone already, or no file descriptor is left: wait, since the next connection may
                // succeed.
                let Ok((stream, _)) = accepted else {
                    sleep(LOOK_INTERVAL).await;
                    continue;
                };
                let explorer = explorer.clone();
                tokio::spawn(async move {
                    let service = service_fn(|request| {
                        let explorer = explorer.clone();
                        async move { Ok::<_, Infallible>(explorer.answer(request).await) }
                    });
                    let mut http = hyper::server::conn::http1::Builder::new();
                    http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(MOST_BODY);
                    // An error means that the browser went away in the middle, which is no fault.
                    _ = http.serve_connection(TokioIo::new(stream), service).await;
                    drop(place);
                });
            }
        });
        // Do not wait for threads that wait for a disk or another program.
        runtime.shutdown_background();
        served
    }
}

/// The body of a response: `first` at once, then the messages of `rest` as they come.
struct Content {
    first: Option<Bytes>,
    rest: Option<mpsc::Receiver<Bytes>>,
}

impl Body for Content {
    type Data = Bytes;
    type Error = Infallible;

    fn poll_frame(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
    ) -> Poll<Option<Result<Frame<Bytes>, Infallible>>> {
        if let Some(first) = self.first.take() {
            return Poll::Ready(Some(Ok(Frame::data(first))));
        }
        match &mut self.rest {
            Some(rest) => rest.poll_recv(context).map(|more| more.map(|more| Ok(Frame::data(more)))),
            None => Poll::Ready(None),
        }
    }

    fn is_end_stream(&self) -> bool {
        self.first.is_none() && self.rest.is_none()
    }

    /// Tells the exact length, unless more is to come.
    fn size_hint(&self) -> SizeHint {
        let length = self.first.as_ref().map_or(0, |first| first.len() as u64);
        if self.rest.is_none() { SizeHint::with_exact(length) } else { SizeHint::default() }
    }
}

/// Permission for the browser to keep an answer in its cache.
#[derive(Clone, Copy, PartialEq)]
enum Keep {
    /// For answers that depend on nothing but their address.
    Long,
    Never,
}

fn response(status: StatusCode, kind: &'static str, keep: Keep, content: Content) -> Response<Content> {
    let mut response = Response::new(content);
    *response.status_mut() = status;
    let headers = response.headers_mut();
    let mut say = |name, value| _ = headers.insert(name, HeaderValue::from_static(value));
    say(header::CONTENT_TYPE, kind);
    say(header::CACHE_CONTROL, if keep == Keep::Long { "private, max-age=3600" } else { "no-store" });
    say(header::CONTENT_SECURITY_POLICY, POLICY);
    say(header::X_CONTENT_TYPE_OPTIONS, "nosniff");
    say(header::REFERRER_POLICY, "no-referrer");
    response
}

fn whole(kind: &'static str, keep: Keep, bytes: impl Into<Bytes>) -> Response<Content> {
    response(StatusCode::OK, kind, keep, Content { first: Some(bytes.into()), rest: None })
}

const JSON: &str = "application/json";

fn told(value: &Value) -> Response<Content> {
    whole(JSON, Keep::Never, value.to_string())
}

impl Explorer {
    async fn answer(self: Arc<Self>, request: Request<Incoming>) -> Response<Content> {
        let answered = async {
            let of = |headers: &HeaderMap, name: &str| {
                headers.get(name).map(|value| value.to_str().unwrap_or("unreadable").to_owned())
            };
            let [host, origin, site] = ["host", "origin", "sec-fetch-site"].map(|name| of(request.headers(), name));
            let sender = Sender { host: host.as_deref(), origin: origin.as_deref(), site: site.as_deref() };
            sender.check(self.port)?;
            match *request.method() {
                Method::GET => {
                    let asked = read(request.uri().path(), request.uri().query().unwrap_or_default())?;
                    self.look(asked).await
                }
                Method::POST | Method::DELETE => {
                    // A form on a foreign page cannot have this content type, so such pages cannot change anything.
                    let is_json = of(request.headers(), "content-type").is_some_and(|kind| kind.starts_with(JSON));
                    if !is_json {
                        return Err(Failure::new(Status::Form, format!("expected a body of {JSON}"), ""));
                    }
                    self.change(request).await
                }
                _ => Err(Failure::new(Status::Method, "this is asked for with GET, POST or DELETE", "")),
            }
        };
        answered.await.unwrap_or_else(|failure| {
            let status = StatusCode::from_u16(failure.status as u16).expect("it is one of those that there are");
            let text = serde_json::to_vec(&failure).expect("texts are JSON");
            response(status, JSON, Keep::Never, Content { first: Some(text.into()), rest: None })
        })
    }

    fn opened(&self, id: &str) -> Result<Arc<Opened>, Failure> {
        let closed = || Failure::new(Status::Missing, "this world is not open", "open it again");
        self.worlds.known(id).ok_or_else(closed)
    }

    /// Gives freed memory back to the system from time to time while something is drawn, and once after that.
    async fn give_back(self: Arc<Self>) {
        let mut look = interval(GIVE_BACK_INTERVAL);
        let mut was_idle = true;
        loop {
            look.tick().await;
            let is_idle = self.studio.queue.is_idle();
            if !(is_idle && was_idle) {
                // If this fails, the process keeps the memory, which does no harm.
                _ = blocking(heap::give_back).await;
            }
            was_idle = is_idle;
        }
    }

    /// Answers requests that change nothing.
    async fn look(self: &Arc<Self>, asked: ReadRequest) -> Result<Response<Content>, Failure> {
        match asked {
            ReadRequest::Page(name) => {
                let (kind, content) = page::file(&name).ok_or_else(Failure::missing)?;
                Ok(whole(kind, Keep::Never, content))
            }
            ReadRequest::Start => self.start().await,
            ReadRequest::Schema => Ok(told(&Preset::schema())),
            ReadRequest::Memory => {
                let Usage { held, most } = self.worlds.budget.usage();
                Ok(told(&json!({ "held_bytes": held, "most_bytes": most })))
            }
            ReadRequest::Tile { world, style, stage, spot } => {
                let pending = self.studio.picture(&self.opened(&world)?, &style, stage, spot)?;
                Ok(whole("image/webp", Keep::Long, pending.bytes().await?))
            }
            ReadRequest::Heights { world, stage, spot } => {
                let pending = self.studio.heights(&self.opened(&world)?, stage, spot)?;
                Ok(whole("text/javascript", Keep::Long, pending.bytes().await?))
            }
            ReadRequest::Names { world, style, spot } => {
                let pending = self.studio.names(&self.opened(&world)?, &style, spot)?;
                Ok(whole(JSON, Keep::Long, pending.bytes().await?))
            }
            ReadRequest::Find { world, query, near_km, limit } => {
                let opened = self.opened(&world)?;
                let malformed = |error: Error| Failure { status: Status::Malformed, ..Failure::of(&error) };
                let search = Search::new(&query).map_err(malformed)?;
                let asked = json!([world, query, near_km, limit]).to_string();
                let work = move || search.run(&opened, near_km, limit);
                let product = self.studio.queue.ask(Lane::Slow, blake3::hash(asked.as_bytes()), work)?.await?;
                Ok(whole(JSON, Keep::Never, product[0].clone()))
            }
            ReadRequest::Watch { world } => Ok(self.watch(self.opened(&world)?)),
            ReadRequest::Bake(number) => Ok(told(&json!(self.bakes.progress(number)?))),
            ReadRequest::Map(number) => {
                let path = self.bakes.map(number)?;
                let picture = blocking(move || std::fs::read(&path)).await?;
                let gone = |_| Failure::new(Status::Missing, "the map of this bake is not there any more", "");
                Ok(whole("image/png", Keep::Never, picture.map_err(gone)?))
            }
        }
    }

    /// Answers with all that a page must know to begin.
    async fn start(self: &Arc<Self>) -> Result<Response<Content>, Failure> {
        let first = self.worlds.first();
        let about = self.open(first).await?;
        let presets = BUILT_IN.iter().map(|(name, text)| json!({ "name": name, "about": summary(text) }));
        let styles = STYLES.iter().map(|(name, text)| json!({ "name": name, "about": summary(text) }));
        let profiles = Profile::ALL.map(|profile| json!({ "name": profile.name(), "about": profile.about() }));
        Ok(told(&json!({
            "version": generator::VERSION, "presets": presets.collect::<Vec<_>>(), "styles": styles.collect::<Vec<_>>(), "profiles": profiles,
            "file": self.worlds.file(), "world": about, "at": self.view.map(|(at_m, _)| at_m), "pixel_m": self.view.map(|(_, pixel_m)| pixel_m),
        })))
    }

    async fn open(self: &Arc<Self>, recipe: WorldRecipe) -> Result<Value, Failure> {
        let explorer = self.clone();
        blocking(move || {
            explorer.worlds.open(&recipe).map(|opened| opened.about()).map_err(|error| Failure::of(&error))
        })
        .await?
    }

    /// Sends an event whenever the preset's file has changed, for as long as the page listens.
    fn watch(self: &Arc<Self>, opened: Arc<Opened>) -> Response<Content> {
        let (sender, receiver) = mpsc::channel(4);
        let explorer = self.clone();
        tokio::spawn(async move {
            let mut last: Result<Preset, Failure> = Ok(opened.preset.clone());
            let mut look = interval(FILE_INTERVAL);
            while !sender.is_closed() {
                look.tick().await;
                if opened.recipe.preset != FILE {
                    continue;
                }
                let (reader, recipe) = (explorer.clone(), opened.recipe.clone());
                let read = blocking(move || reader.worlds.read(&recipe).map_err(|error| Failure::of(&error))).await;
                let now = read.and_then(|read| read).map(|(.., preset)| preset);
                if now == last {
                    continue;
                }
                let told = match &now {
                    Ok(_) => explorer.open(opened.recipe.clone()).await,
                    Err(failure) => Err(failure.clone()),
                };
                last = now;
                let event = match told {
                    Ok(about) => format!("event: changed\ndata: {about}\n\n"),
                    Err(failure) => format!("event: faulty\ndata: {}\n\n", json!(failure)),
                };
                if sender.send(event.into()).await.is_err() {
                    break;
                }
            }
        });
        let content = Content { first: Some("retry: 1000\n\n".into()), rest: Some(receiver) };
        response(StatusCode::OK, "text/event-stream", Keep::Never, content)
    }

    /// Answers requests that open, bake, stop or save something.
    async fn change(self: &Arc<Self>, request: Request<Incoming>) -> Result<Response<Content>, Failure> {
        let (method, path) = (request.method().clone(), request.uri().path().to_owned());
        let parts: Vec<&str> = path.split('/').skip(1).collect();
        match (&method, &parts[..]) {
            (&Method::POST, ["api", "worlds"]) => Ok(told(&self.open(body(request).await?).await?)),
            (&Method::POST, ["api", "plan"]) => self.plan(body(request).await?).await,
            (&Method::POST, ["api", "bakes"]) => {
                let order: Order = body(request).await?;
                let arguments = Bakes::arguments(&order, &*self.opened(&order.world)?)?;
                let explorer = self.clone();
                let number = blocking(move || explorer.bakes.begin(&arguments, order.mode)).await??;
                Ok(told(&json!({ "bake": number })))
            }
            (&Method::DELETE, ["api", "bakes", _]) => match read(&path, "")? {
                ReadRequest::Bake(number) => Ok(told(&json!(self.bakes.cancel(number)?))),
                _ => Err(Failure::missing()),
            },
            (&Method::POST, ["api", "save"]) => {
                let Save { name, world, overwrite } = body(request).await?;
                let opened = self.opened(&world)?;
                let saved = blocking(move || save(&opened, &name, overwrite)).await??;
                Ok(told(&json!({ "path": saved })))
            }
            _ => Err(Failure::missing()),
        }
    }

    async fn plan(self: &Arc<Self>, order: Order) -> Result<Response<Content>, Failure> {
        let arguments = Bakes::arguments(&order, &*self.opened(&order.world)?)?;
        let mut answer = json!({ "command": typed(&arguments) });
        if !order.quick {
            let explorer = self.clone();
            let (plan, fault) = blocking(move || explorer.bakes.plan(&arguments)).await??;
            for key in
                ["tiles", "width", "height", "files", "disk_bytes", "memory_bytes", "seconds", "out", "bounds_km"]
            {
                answer[key] = plan[key].clone();
            }
            answer["fault"] = json!(fault);
        }
        Ok(told(&answer))
    }
}

/// A request to write a preset into a file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Save {
    name: String,
    world: String,
    #[serde(default)]
    overwrite: bool,
}

/// Runs work that waits for the disk or another program on a thread of its own, so that requests are answered
/// meanwhile.
async fn blocking<T: Send + 'static>(work: impl FnOnce() -> T + Send + 'static) -> Result<T, Failure> {
    let broken = |_| Failure::new(Status::Broken, "this could not be done: that is a fault of the program", "");
    spawn_blocking(work).await.map_err(broken)
}

/// Reads the body of a request as JSON.
async fn body<T: DeserializeOwned>(request: Request<Incoming>) -> Result<T, Failure> {
    let late = |_| Failure::new(Status::Malformed, "the body did not come", "");
    let large = |_| Failure::new(Status::Large, format!("a body has at most {MOST_BODY} bytes"), "");
    let bytes = timeout(PATIENCE, Limited::new(request.into_body(), MOST_BODY).collect()).await;
    let bytes = bytes.map_err(late)?.map_err(large)?.to_bytes();
    serde_json::from_slice(&bytes).map_err(|error| Failure::new(Status::Malformed, error.to_string(), ""))
}
