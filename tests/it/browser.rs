//! Headless Chromium, driven by chromedriver: <https://www.w3.org/TR/webdriver2/>.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

/// Time limit of any action on a page, on a busy machine.
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Browser with one page.
pub struct Browser {
    driver: Child,
    port: u16,
    session: String,
    /// Kept open: the driver may write to it.
    _output: BufReader<ChildStdout>,
}

impl Browser {
    /// Opens a file in a window of the given size; `None`, with a message, without chromedriver.
    pub fn open(page: &Path, [width, height]: [u32; 2]) -> Option<Self> {
        let started =
            Command::new("chromedriver").arg("--port=0").stdout(Stdio::piped()).stderr(Stdio::null()).spawn();
        let Ok(mut driver) = started else {
            evidence::skipped("chromedriver");
            return None;
        };
        let mut output = BufReader::new(driver.stdout.take().unwrap());
        let mut lines = output.by_ref().lines();
        let port = lines.find_map(|line| {
            line.unwrap().split_once("successfully on port ")?.1.trim_end_matches('.').parse::<u16>().ok()
        });
        let port = port.expect("a port");
        let mut browser = Self { driver, port, session: String::new(), _output: output };
        let size = format!("--window-size={width},{height}");
        let arguments = [
            "--headless=new",
            "--no-sandbox",
            "--disable-dev-shm-usage",
            "--disable-background-networking",
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            &size,
        ];
        let mut options = json!({ "args": arguments });
        if width < 500 {
            // no window is so narrow
            let screen = json!({ "width": width, "height": height, "pixelRatio": 1, "touch": true });
            options["mobileEmulation"] = json!({ "deviceMetrics": screen });
        }
        let asked = json!({ "capabilities": { "alwaysMatch": {
            "goog:chromeOptions": options,
            "goog:loggingPrefs": { "browser": "ALL", "performance": "ALL" },
        } } });
        let session = browser.ask("POST", "", &asked);
        browser.session = format!("/{}", session["sessionId"].as_str().expect("a session"));
        browser.ask("POST", "/url", &json!({ "url": format!("file://{}", page.display()) }));
        Some(browser)
    }

    /// Sends a command of the protocol; returns its value.
    #[track_caller]
    fn ask(&self, method: &str, path: &str, body: &Value) -> Value {
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).unwrap();
        stream.set_read_timeout(Some(TIME_LIMIT)).unwrap();
        let body = if method == "POST" { body.to_string() } else { String::new() };
        let head = format!(
            "{method} /session{}{path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\nContent-Length: \
             {}\r\n\r\n",
            self.session,
            body.len()
        );
        stream.write_all((head + &body).as_bytes()).unwrap();
        let mut reader = BufReader::new(stream);
        let (mut length, mut line) = (0, String::new());
        while reader.read_line(&mut line).unwrap() > 2 {
            if let Some((name, value)) = line.split_once(':')
                && name.eq_ignore_ascii_case("content-length")
            {
                length = value.trim().parse().unwrap();
            }
            line.clear();
        }
        let mut answer = vec![0; length];
        reader.read_exact(&mut answer).unwrap();
        let answer: Value = serde_json::from_slice(&answer).unwrap();
        let value = answer["value"].clone();
        assert!(value.get("error").is_none(), "{method} {path} {body}: {value:#}");
        value
    }

    /// Evaluates an expression in the page.
    #[track_caller]
    pub fn value(&self, expression: &str) -> Value {
        self.ask("POST", "/execute/sync", &json!({ "script": format!("return {expression}"), "args": [] }))
    }

    /// Waits until an expression is true.
    #[track_caller]
    pub fn wait(&self, expression: &str) {
        let begun = Instant::now();
        while self.value(&format!("Boolean({expression})")) != true {
            assert!(begun.elapsed() < TIME_LIMIT, "{expression} never holds: {:#?}", self.complaints());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Faults of the layout: texts that overlap, are cut off or stand outside of the window, and controls
    /// without a name.
    #[track_caller]
    pub fn layout_faults(&self) -> Vec<Value> {
        let script = json!({ "script": include_str!("layout.js"), "args": [] });
        self.ask("POST", "/execute/sync", &script).as_array().unwrap().clone()
    }

    #[track_caller]
    fn element(&self, selector: &str) -> String {
        let found = self.ask("POST", "/element", &json!({ "using": "css selector", "value": selector }));
        found.as_object().unwrap().values().next().unwrap().as_str().unwrap().to_owned()
    }

    /// Clicks an element.
    #[track_caller]
    pub fn click(&self, selector: &str) {
        let element = self.element(selector);
        self.ask("POST", &format!("/element/{element}/click"), &json!({}));
    }

    /// Presses keys in an element.
    #[track_caller]
    pub fn press(&self, selector: &str, keys: &str) {
        let element = self.element(selector);
        self.ask("POST", &format!("/element/{element}/value"), &json!({ "text": keys }));
    }

    /// Drags fingers across the window, or the mouse with its button down, with a pause on the way; each from
    /// one place to another.
    #[track_caller]
    pub fn drag(&self, kind: &str, ways: &[[[f64; 2]; 2]]) {
        let step = |[x, y]: [f64; 2], duration: u32| {
            let [x, y] = [x.round() as i64, y.round() as i64];
            json!({ "type": "pointerMove", "duration": duration, "x": x, "y": y })
        };
        let pointer = |(k, &[from, to]): (usize, &[[f64; 2]; 2])| {
            let half = [0, 1].map(|d| 0.5 * (from[d] + to[d]));
            let actions = json!([
                step(from, 0), { "type": "pause", "duration": 400 }, { "type": "pointerDown", "button": 0 },
                step(half, 80), step(to, 80), { "type": "pointerUp", "button": 0 },
            ]);
            let id = format!("{kind}{k}");
            json!({ "type": "pointer", "id": id, "parameters": { "pointerType": kind }, "actions": actions })
        };
        let actions: Vec<Value> = ways.iter().enumerate().map(pointer).collect();
        self.ask("POST", "/actions", &json!({ "actions": actions }));
    }

    /// Takes a screenshot if `VIEW_PICTURES` names a folder.
    pub fn picture(&self, name: &str) {
        if let Some(folder) = std::env::var_os("VIEW_PICTURES") {
            let taken = self.ask("GET", "/screenshot", &json!({}));
            std::fs::write(Path::new(&folder).join(name), taken.as_str().unwrap()).unwrap();
        }
    }

    fn log(&self, kind: &str) -> Vec<Value> {
        self.ask("POST", "/se/log", &json!({ "type": kind })).as_array().unwrap().clone()
    }

    /// Errors of the console.
    pub fn complaints(&self) -> Vec<Value> {
        self.log("browser").into_iter().filter(|entry| entry["level"] == "SEVERE").collect()
    }

    /// Addresses that the page requested, besides itself and its content.
    pub fn requests(&self) -> Vec<String> {
        let told = |entry: &Value| -> Option<String> {
            let message: Value = serde_json::from_str(entry["message"].as_str()?).ok()?;
            let message = &message["message"];
            let url = message["params"]["request"]["url"].as_str()?.to_owned();
            (message["method"] == "Network.requestWillBeSent").then_some(url)
        };
        let inside = |url: &String| ["file:", "data:", "blob:"].iter().any(|own| url.starts_with(own));
        self.log("performance").iter().filter_map(told).filter(|url| !inside(url)).collect()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() && !std::thread::panicking() {
            self.ask("DELETE", "", &json!({}));
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}
