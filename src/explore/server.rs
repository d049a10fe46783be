//! The explorer's HTTP server, for the browser on this machine.

use std::convert::Infallible;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use axum::body::{Bytes, to_bytes};
use axum::extract::{Path, Request, State};
use axum::http::{HeaderValue, Method, StatusCode, Uri, header};
use axum::middleware::{Next, from_fn_with_state, map_response};
use axum::response::sse::{Event, Sse};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use futures_util::{StreamExt, stream};
use hyper::server::conn::http1;
use hyper_util::rt::{TokioIo, TokioTimer};
use hyper_util::service::TowerToHyperService;
use serde::Deserialize;
use serde::de::DeserializeOwned;
use serde_json::{Value, json};
use tokio::runtime::{Builder, Runtime};
use tokio::sync::Semaphore;
use tokio::task::spawn_blocking;
use tokio::time::{interval, sleep, timeout};

use crate::clock::Clock;
use crate::error::Error;
use crate::explore::bakes::{Bakes, Order, typed};
use crate::explore::cache::Cache;
use crate::explore::charts::Charts;
use crate::explore::heap;
use crate::explore::page;
use crate::explore::queue::{Lane, Queue};
use crate::explore::request::{Failure, FindQuery, Sender, tile_at};
use crate::explore::save_preset::save;
use crate::explore::search::Search;
use crate::explore::tile_address::Stage;
use crate::explore::tiles::Studio;
use crate::explore::worlds::{FILE, Given, Opened, WorldRecipe, Worlds};
use crate::export::Profile;
use crate::generator;
use crate::map::style::STYLES;
use crate::memory::{Budget, Usage};
use crate::preset::{BUILT_IN, Preset, summary};
use crate::stop::Stop;

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
    stop: Stop,
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
    /// Binds an explorer to the loopback address of this machine, which no other machine reaches. `stop` ends it.
    ///
    /// # Errors
    /// When something is wrong with the preset, the port is taken, or the folder for drawn tiles cannot be used.
    pub fn bind(options: Options, stop: &Stop) -> Result<Server, Error> {
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
        let studio = Arc::new(Studio { charts: Charts::default(), cache, queue: Queue::start(threads, stop)? });
        let explorer = Explorer { view, port: address.port(), worlds, studio, bakes: Bakes::new(program) };
        let (runtime, explorer) = (runtime.map_err(cannot)?, Arc::new(explorer));
        Ok(Server { listener, address, runtime, explorer, stop: stop.clone() })
    }

    /// The address of the page.
    pub fn url(&self) -> String {
        format!("http://{}/", self.address)
    }

    /// Answers requests until it is stopped.
    ///
    /// # Errors
    /// [`Error::Interrupted`] when it is stopped; another error when the system takes the port away.
    pub fn serve(self) -> Result<(), Error> {
        let Server { listener, runtime, explorer, stop, .. } = self;
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(listener).map_err(Error::io("127.0.0.1"))?;
            tokio::spawn(explorer.clone().give_back());
            let service = TowerToHyperService::new(router(explorer));
            let free = Arc::new(Semaphore::new(CONNECTIONS));
            loop {
                let connection = async {
                    let place = free.clone().acquire_owned().await.expect("it is never closed");
                    (listener.accept().await, place)
                };
                stop.check()?;
                let Ok((accepted, place)) = timeout(LOOK_INTERVAL, connection).await else { continue };
                // The client has gone already, or no file descriptor is left: wait, since the next connection may
                // succeed.
                let Ok((stream, _)) = accepted else {
                    sleep(LOOK_INTERVAL).await;
                    continue;
                };
                let mut http = http1::Builder::new();
                http.timer(TokioTimer::new()).header_read_timeout(PATIENCE).max_buf_size(MOST_BODY);
                let connection = http.serve_connection(TokioIo::new(stream), service.clone());
                tokio::spawn(async move {
                    // An error means that the browser went away in the middle, which is no fault.
                    _ = connection.await;
                    drop(place);
                });
            }
        });
        // Do not wait for threads that wait for a disk or another program.
        runtime.shutdown_background();
        served
    }
}

const JSON: &str = "application/json";

/// Returns the addresses of the explorer, with their handlers.
fn router(explorer: Arc<Explorer>) -> Router {
    Router::new()
        .route("/", get(async || file("index.html")))
        .route("/{name}", get(async |Path(name): Path<String>| file(&name)))
        .route("/api/start", get(start))
        .route("/api/schema", get(async || Json(Preset::schema())))
        .route("/api/memory", get(memory))
        .route("/api/worlds", post(open))
        .route("/api/plan", post(plan))
        .route("/api/save", post(save_world))
        .route("/api/bakes", post(begin))
        .route("/api/bakes/{number}", get(progress).delete(cancel))
        .route("/bakes/{number}/map.png", get(map))
        .route("/w/{world}/find", get(find))
        .route("/w/{world}/watch", get(watch))
        .route("/w/{world}/heights/{stage}/{zoom}/{x}/{y}", get(heights))
        .route("/w/{world}/names/{style}/{zoom}/{x}/{y}", get(names))
        .route("/w/{world}/{style}/{stage}/{zoom}/{x}/{y}", get(picture))
        .fallback(async || Failure::missing())
        .method_not_allowed_fallback(async || {
            Failure::new(StatusCode::METHOD_NOT_ALLOWED, "this address is for other methods", "")
        })
        .layer(from_fn_with_state(explorer.clone(), admitted))
        .layer(map_response(with_policy))
        .with_state(explorer)
}

/// Passes on the requests that the explorer's own page may send, with their bodies read.
async fn admitted(State(explorer): ExplorerState, request: Request, next: Next) -> Result<Response, Failure> {
    let (head, body) = request.into_parts();
    let of = |name: &str| head.headers.get(name).map(|value| value.to_str().unwrap_or("unreadable"));
    Sender { host: of("host"), origin: of("origin"), site: of("sec-fetch-site") }.check(explorer.port)?;
    let mut bytes = Bytes::new();
    if matches!(head.method, Method::POST | Method::DELETE) {
        // A form on a foreign page cannot have this content type, so such pages cannot change anything.
        if !of("content-type").is_some_and(|kind| kind.starts_with(JSON)) {
            return Err(Failure::new(StatusCode::UNSUPPORTED_MEDIA_TYPE, format!("expected a body of {JSON}"), ""));
        }
        let late = |_| Failure::malformed("the body did not come");
        let large =
            |_| Failure::new(StatusCode::PAYLOAD_TOO_LARGE, format!("a body has at most {MOST_BODY} bytes"), "");
        bytes = timeout(PATIENCE, to_bytes(body, MOST_BODY)).await.map_err(late)?.map_err(large)?;
    }
    Ok(next.run(Request::from_parts(head, bytes.into())).await)
}

/// Adds the headers of all responses. The browser keeps only those responses that say so themselves.
async fn with_policy(mut response: Response) -> impl IntoResponse {
    response.headers_mut().entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    let policy = [
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ];
    (policy, response)
}

/// Returns a response that depends on nothing but its address, so that the browser may keep it.
fn kept(kind: &'static str, bytes: Vec<u8>) -> Response {
    ([(header::CONTENT_TYPE, kind), (header::CACHE_CONTROL, "private, max-age=3600")], bytes).into_response()
}

impl IntoResponse for Failure {
    fn into_response(self) -> Response {
        (self.status, Json(self)).into_response()
    }
}

type ExplorerState = State<Arc<Explorer>>;

type JsonAnswer = Result<Json<Value>, Failure>;

impl Explorer {
    fn opened(&self, id: &str) -> Result<Arc<Opened>, Failure> {
        let closed = || Failure::new(StatusCode::NOT_FOUND, "this world is not open", "open it again");
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
                _ = spawn_blocking(heap::give_back).await;
            }
            was_idle = is_idle;
        }
    }

    async fn open(self: Arc<Self>, recipe: WorldRecipe) -> Result<Value, Failure> {
        blocking(move || self.worlds.open(&recipe).map(|opened| opened.about())).await
    }
}

fn file(name: &str) -> Result<Response, Failure> {
    let (kind, content) = page::file(name).ok_or_else(Failure::missing)?;
    Ok(([(header::CONTENT_TYPE, kind)], content).into_response())
}

/// Answers with all that a page must know to begin.
async fn start(State(explorer): ExplorerState) -> JsonAnswer {
    let about = explorer.clone().open(explorer.worlds.first()).await?;
    let presets = BUILT_IN.iter().map(|(name, text)| json!({ "name": name, "about": summary(text) }));
    let styles = STYLES.iter().map(|(name, text)| json!({ "name": name, "about": summary(text) }));
    let profiles = Profile::ALL.map(|profile| json!({ "name": profile.name(), "about": profile.about() }));
    Ok(Json(json!({
        "version": generator::VERSION, "presets": presets.collect::<Vec<_>>(), "styles": styles.collect::<Vec<_>>(),
        "profiles": profiles, "file": explorer.worlds.file(), "world": about,
        "at": explorer.view.map(|(at_m, _)| at_m), "pixel_m": explorer.view.map(|(_, pixel_m)| pixel_m),
    })))
}

async fn memory(State(explorer): ExplorerState) -> Json<Value> {
    let Usage { held, most } = explorer.worlds.budget.usage();
    Json(json!({ "held_bytes": held, "most_bytes": most }))
}

async fn open(State(explorer): ExplorerState, body: Bytes) -> JsonAnswer {
    Ok(Json(explorer.open(parsed(&body)?).await?))
}

/// World, style and stage in the address of a tile. Heights have no style, and names are those of the full picture.
#[derive(Deserialize)]
struct TilePath {
    world: String,
    #[serde(default)]
    style: String,
    #[serde(default)]
    stage: Stage,
}

async fn picture(State(explorer): ExplorerState, Path(at): Path<TilePath>, uri: Uri) -> Result<Response, Failure> {
    let is_dense = uri.path().ends_with("@2x.webp");
    let tile = tile_at(uri.path(), if is_dense { "@2x.webp" } else { ".webp" }, is_dense)?;
    let pending = explorer.studio.picture(&explorer.opened(&at.world)?, &at.style, at.stage, tile)?;
    Ok(kept("image/webp", pending.bytes().await?))
}

async fn heights(State(explorer): ExplorerState, Path(at): Path<TilePath>, uri: Uri) -> Result<Response, Failure> {
    // Full heights would take so long that nobody would still point at the tile: there is no address for them.
    if at.stage == Stage::Full {
        return Err(Failure::missing());
    }
    let tile = tile_at(uri.path(), ".js", false)?;
    let pending = explorer.studio.heights(&explorer.opened(&at.world)?, at.stage, tile)?;
    Ok(kept("text/javascript", pending.bytes().await?))
}

async fn names(State(explorer): ExplorerState, Path(at): Path<TilePath>, uri: Uri) -> Result<Response, Failure> {
    let tile = tile_at(uri.path(), ".json", false)?;
    let pending = explorer.studio.names(&explorer.opened(&at.world)?, &at.style, tile)?;
    Ok(kept(JSON, pending.bytes().await?))
}

async fn find(State(explorer): ExplorerState, Path(world): Path<String>, uri: Uri) -> Result<Response, Failure> {
    let FindQuery { text, near_km, limit } = FindQuery::read(&uri)?;
    let opened = explorer.opened(&world)?;
    let malformed = |error: Error| Failure { status: StatusCode::BAD_REQUEST, ..Failure::from(error) };
    let search = Search::new(&text).map_err(malformed)?;
    let asked = json!([world, text, near_km, limit]).to_string();
    let work = move |clock: &Clock| search.run(&opened, near_km, limit, clock);
    let product = explorer.studio.queue.ask(Lane::Slow, blake3::hash(asked.as_bytes()), work)?.await?;
    Ok(([(header::CONTENT_TYPE, JSON)], product[0].clone()).into_response())
}

/// Sends an event whenever the preset's file has changed, for as long as the page listens.
async fn watch(State(explorer): ExplorerState, Path(world): Path<String>) -> Result<impl IntoResponse, Failure> {
    let opened = explorer.opened(&world)?;
    let last: Result<Preset, Failure> = Ok(opened.preset.clone());
    let state = (explorer, opened, last, interval(FILE_INTERVAL));
    let changes = stream::unfold(state, async |(explorer, opened, last, mut look)| {
        loop {
            look.tick().await;
            if opened.recipe.preset != FILE {
                continue;
            }
            let (reader, recipe) = (explorer.clone(), opened.recipe.clone());
            let now = blocking(move || reader.worlds.read(&recipe)).await.map(|(.., preset)| preset);
            if now == last {
                continue;
            }
            let told = match &now {
                Ok(_) => explorer.clone().open(opened.recipe.clone()).await,
                Err(failure) => Err(failure.clone()),
            };
            let event = match told {
                Ok(about) => Event::default().event("changed").data(about.to_string()),
                Err(failure) => Event::default().event("faulty").data(json!(failure).to_string()),
            };
            break Some((Ok::<_, Infallible>(event), (explorer, opened, now, look)));
        }
    });
    let again = Event::default().retry(Duration::from_secs(1));
    Ok(Sse::new(stream::iter([Ok(again)]).chain(changes)))
}

async fn begin(State(explorer): ExplorerState, body: Bytes) -> JsonAnswer {
    let order: Order = parsed(&body)?;
    let arguments = Bakes::arguments(&order, &*explorer.opened(&order.world)?)?;
    let number = blocking(move || explorer.bakes.begin(&arguments, order.mode)).await?;
    Ok(Json(json!({ "bake": number })))
}

async fn progress(State(explorer): ExplorerState, Path(number): Path<u64>) -> JsonAnswer {
    Ok(Json(json!(explorer.bakes.progress(number)?)))
}

async fn cancel(State(explorer): ExplorerState, Path(number): Path<u64>) -> JsonAnswer {
    Ok(Json(json!(explorer.bakes.cancel(number)?)))
}

async fn map(State(explorer): ExplorerState, Path(number): Path<u64>) -> Result<impl IntoResponse, Failure> {
    let path = explorer.bakes.map(number)?;
    let gone = |_| Failure::new(StatusCode::NOT_FOUND, "the map of this bake is not there any more", "");
    let picture = blocking(move || std::fs::read(&path).map_err(gone)).await?;
    Ok(([(header::CONTENT_TYPE, "image/png")], picture))
}

async fn plan(State(explorer): ExplorerState, body: Bytes) -> JsonAnswer {
    let order: Order = parsed(&body)?;
    let arguments = Bakes::arguments(&order, &*explorer.opened(&order.world)?)?;
    let mut answer = json!({ "command": typed(&arguments) });
    if !order.quick {
        let (plan, fault) = blocking(move || explorer.bakes.plan(&arguments)).await?;
        for key in ["tiles", "width", "height", "files", "disk_bytes", "memory_bytes", "seconds", "out", "bounds_km"] {
            answer[key] = plan[key].clone();
        }
        answer["fault"] = json!(fault);
    }
    Ok(Json(answer))
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

async fn save_world(State(explorer): ExplorerState, body: Bytes) -> JsonAnswer {
    let Save { name, world, overwrite } = parsed(&body)?;
    let opened = explorer.opened(&world)?;
    let saved = blocking(move || save(&opened, &name, overwrite)).await?;
    Ok(Json(json!({ "path": saved })))
}

/// Runs work that waits for the disk or another program on a thread of its own, so that requests are answered
/// meanwhile.
async fn blocking<T: Send + 'static, E: Into<Failure> + Send + 'static>(
    work: impl FnOnce() -> Result<T, E> + Send + 'static,
) -> Result<T, Failure> {
    let broken = |_| Failure::broken("this could not be done: that is a fault of the program");
    spawn_blocking(work).await.map_err(broken)?.map_err(E::into)
}

/// Parses the body of a request as JSON.
fn parsed<T: DeserializeOwned>(body: &[u8]) -> Result<T, Failure> {
    serde_json::from_slice(body).map_err(|error| Failure::malformed(error.to_string()))
}
