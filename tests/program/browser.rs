//! A real browser, driven over a pipe (the DevTools protocol), for tests of pages.

use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use serde_json::{Value, json};

/// Set if these tests must not be skipped, as in CI.
const REQUIRED: &str = "TONGUE_FIT_REQUIRE_BROWSER";
const PATIENCE: Duration = Duration::from_secs(240);

/// The browser of this machine; `None` if there is none and none is required.
pub fn found() -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let found = std::env::split_paths(&paths)
        .flat_map(|folder| names.map(|name| folder.join(name)))
        .find(|program| program.is_file());
    if found.is_none() {
        assert!(std::env::var_os(REQUIRED).is_none(), "{REQUIRED} is set, but no chromium is there");
        println!("skipped: no chromium in the PATH");
    }
    found
}

pub struct Browser {
    child: Child,
    to: File,
    from: BufReader<File>,
    calls: u64,
    /// Events that the browser sent without being asked.
    events: Vec<Value>,
    _folder: tempfile::TempDir,
}

#[derive(Debug, Clone)]
pub struct Page(String);

impl Browser {
    pub fn start() -> Option<Self> {
        let program = found()?;
        let folder = tempfile::tempdir().unwrap();
        let pipes = ["in", "out"].map(|name| folder.path().join(name));
        assert!(Command::new("mkfifo").args(&pipes).status().unwrap().success());
        let line = "exec \"$0\" --headless --no-sandbox --disable-gpu --remote-debugging-pipe \
                    --user-data-dir=\"$1/profile\" about:blank 3<\"$1/in\" 4>\"$1/out\"";
        let child = Command::new("sh")
            .args(["-c", line])
            .args([&program, folder.path()])
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let to = OpenOptions::new().write(true).open(&pipes[0]).unwrap();
        let from = BufReader::new(File::open(&pipes[1]).unwrap());
        Some(Self { child, to, from, calls: 0, events: Vec::new(), _folder: folder })
    }

    fn call(&mut self, page: Option<&Page>, method: &str, parameters: Value) -> Value {
        self.calls += 1;
        let mut message = json!({"id": self.calls, "method": method, "params": parameters});
        if let Some(Page(session)) = page {
            message["sessionId"] = json!(session);
        }
        self.to.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let mut text = Vec::new();
            self.from.read_until(0, &mut text).unwrap();
            text.pop();
            let mut told: Value = serde_json::from_slice(&text).expect("the browser went away");
            if told["id"] == self.calls {
                assert!(told["error"].is_null(), "{method}: {}", told["error"]);
                return told["result"].take();
            }
            self.events.push(told);
        }
    }

    /// Opens a file with a fragment such as `#v=a` or none, and waits until it is ready.
    pub fn open(&mut self, file: &Path, fragment: &str) -> Page {
        self.open_after("", file, fragment)
    }

    /// Like [`Self::open`], after running a script.
    pub fn open_after(&mut self, script: &str, file: &Path, fragment: &str) -> Page {
        let target = self.call(None, "Target.createTarget", json!({"url": "about:blank"}));
        let to = json!({"targetId": target["targetId"], "flatten": true});
        let session = self.call(None, "Target.attachToTarget", to);
        let page = Page(session["sessionId"].as_str().unwrap().to_owned());
        for domain in ["Page", "Runtime", "Log"] {
            self.call(Some(&page), &format!("{domain}.enable"), json!({}));
        }
        self.call(Some(&page), "Page.addScriptToEvaluateOnNewDocument", json!({"source": script}));
        let still = json!({"features": [{"name": "prefers-reduced-motion", "value": "reduce"}]});
        self.call(Some(&page), "Emulation.setEmulatedMedia", still);
        let url = format!("file://{}{fragment}", file.display());
        self.call(Some(&page), "Page.navigate", json!({"url": url}));
        self.wait(&page, "document.body?.dataset.ready === 'yes'");
        page
    }

    pub fn run(&mut self, page: &Page, expression: &str) -> Value {
        let how = json!({"expression": expression, "awaitPromise": true, "returnByValue": true});
        let mut answer = self.call(Some(page), "Runtime.evaluate", how);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}", answer["exceptionDetails"]);
        answer["result"]["value"].take()
    }

    /// Sets a control to a value and sends the event that a user's action would cause.
    pub fn set(&mut self, page: &Page, control: &str, event: &str, value: &str) {
        let set = format!("byId('{control}').value = '{value}'");
        self.run(page, &format!("{set}; byId('{control}').dispatchEvent(new Event('{event}'))"));
    }

    /// Waits until an expression is true.
    pub fn wait(&mut self, page: &Page, expression: &str) {
        let begin = Instant::now();
        while self.run(page, expression) != true {
            if begin.elapsed() > PATIENCE {
                let said = self.run(page, "document.body.innerText");
                panic!("{expression} did not come true: {said}, {:?}", self.complaints());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Shows a page on a screen of this size (CSS pixels); a phone has touch.
    pub fn size(&mut self, page: &Page, width: u32, height: u32, phone: bool) {
        let screen = json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": phone});
        self.call(Some(page), "Emulation.setDeviceMetricsOverride", screen);
        self.call(Some(page), "Emulation.setTouchEmulationEnabled", json!({"enabled": phone}));
    }

    /// Drags a finger from one point to another (CSS pixels of the window) and lifts it.
    pub fn swipe(&mut self, page: &Page, from: [f64; 2], to: [f64; 2]) {
        let steps = 12;
        for step in 0..=steps {
            let part = f64::from(step) / f64::from(steps);
            let [x, y] = [0, 1].map(|i| from[i] + part * (to[i] - from[i]));
            let kind = if step == 0 { "touchStart" } else { "touchMove" };
            let touch = json!({"type": kind, "touchPoints": [{"x": x, "y": y}]});
            self.call(Some(page), "Input.dispatchTouchEvent", touch);
            std::thread::sleep(Duration::from_millis(16));
        }
        let lifted = json!({"type": "touchEnd", "touchPoints": []});
        self.call(Some(page), "Input.dispatchTouchEvent", lifted);
    }

    pub fn press(&mut self, page: &Page, key: &str, code: u32) {
        for kind in ["rawKeyDown", "keyUp"] {
            let how = json!({"type": kind, "key": key, "code": key, "windowsVirtualKeyCode": code});
            self.call(Some(page), "Input.dispatchKeyEvent", how);
        }
    }

    /// Roles of the controls that have no accessible name, and the number of all controls.
    pub fn nameless_controls(&mut self, page: &Page) -> (Vec<String>, usize) {
        let tree = self.call(Some(page), "Accessibility.getFullAXTree", json!({}));
        let roles =
            ["slider", "button", "combobox", "checkbox", "radio", "spinbutton", "textbox", "img", "image"];
        let nodes = tree["nodes"].as_array().unwrap().iter().filter(|n| n["ignored"] != true);
        let controls: Vec<_> =
            nodes.filter(|n| n["role"]["value"].as_str().is_some_and(|r| roles.contains(&r))).collect();
        let nameless = controls.iter().filter(|n| n["name"]["value"].as_str().is_none_or(str::is_empty));
        (nameless.map(|n| n["role"]["value"].to_string()).collect(), controls.len())
    }

    /// The first messages on the console, exceptions, and refused requests.
    fn complaints(&self) -> Vec<String> {
        let kinds = ["Runtime.consoleAPICalled", "Runtime.exceptionThrown", "Log.entryAdded"];
        let told = self.events.iter().filter(|e| e["method"].as_str().is_some_and(|m| kinds.contains(&m)));
        told.map(|e| e["params"].to_string().chars().take(400).collect()).take(3).collect()
    }
}

/// Fails a test whose pages complained, unless it has failed already.
impl Drop for Browser {
    fn drop(&mut self) {
        let complaints = self.complaints();
        let _ = self.to.write_all(b"{\"id\":0,\"method\":\"Browser.close\"}\0");
        for _ in 0..100 {
            if matches!(self.child.try_wait(), Ok(Some(_))) {
                break;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        let _ = self.child.kill();
        let _ = self.child.wait();
        assert!(std::thread::panicking() || complaints.is_empty(), "{complaints:?}");
    }
}
