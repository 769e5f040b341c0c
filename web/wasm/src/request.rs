use serde::Deserialize;
use serde_json::{Value, json};
use tongue_fit::measured::TargetKind;
use tongue_fit::posterior::Draw;
use tongue_fit::scene::Scene;

use crate::engine::{BodyText, Engine};
use crate::fits;

#[derive(Deserialize)]
#[serde(tag = "ask", rename_all = "snake_case", deny_unknown_fields)]
enum Request {
    /// Makes the body of a scene.
    Open { body: BodyText, scene: Scene },
    /// Sets weight and palate.
    Act { scene: Scene },
    /// One equilibrium from rest, and whether it is on the branch that begins there.
    Simulate { tensions: Vec<String>, scene: Scene },
    /// Parses texts such as `GGa=12`.
    Tensions { tensions: Vec<String> },
    /// Sets the positions to a shape that was solved elsewhere.
    Place { positions_m: Vec<[f64; 2]> },
    /// Reads a table of lengths: the bytes after the request, this text, or the built-in table.
    Table { text: Option<String>, file: String },
    /// One fit.
    Fit {
        subject: String,
        vowel: String,
        baseline: Option<String>,
        target: String,
        /// Whether palate and teeth stop the tongue.
        #[serde(default)]
        walls: bool,
    },
    /// One vowel with the jaw, the hyoid and the lips of speech.
    Spoken { subject: String, vowel: String, baseline: Option<String>, target: String },
    /// The built-in tongue in space, at rest.
    OpenSpace,
    /// A few iterations towards the equilibrium of the tongue in space.
    MoveInSpace { activations: Vec<f64>, iterations: usize },
    /// One equilibrium of the tongue in space, followed from rest.
    SettleInSpace { activations: Vec<f64> },
    /// Draws of the posterior of a row by one of two groups of chains.
    Draws { subject: String, vowel: String, baseline: Option<String>, group: usize },
    /// Which muscles pull harder than in the baseline, with probabilities, from the draws of both groups.
    Verdict { subject: String, vowel: String, baseline: Option<String>, draws: Vec<Draw> },
}

/// The answer to a request, as JSON; the error is the program's message. A zero byte and the bytes of a file may follow the request.
pub fn answer(request: &[u8], engine: &mut Option<Engine>) -> Result<String, String> {
    let (request, file_bytes) = match request.iter().position(|&byte| byte == 0) {
        Some(end) => (&request[..end], Some(&request[end + 1..])),
        None => (request, None),
    };
    let request =
        serde_json::from_slice(request).map_err(|e| format!("the page sent an unknown request: {e}"))?;
    let value = match (request, engine) {
        (Request::Open { body, scene }, engine) => {
            let data = engine.take().map(|e| e.data);
            let made = engine.insert(Engine::new(&body, scene, data)?);
            Ok(made.describe())
        }
        (_, None) => return Err("there is no body yet".to_owned()),
        (Request::Act { scene }, Some(engine)) => engine.act(scene).map(|()| json!({})),
        (Request::Simulate { tensions, scene }, Some(engine)) => to_value(engine.simulate(&tensions, scene)?),
        (Request::Tensions { tensions }, Some(engine)) => {
            engine.tensions(&tensions).map(|all| json!({"tensions_n": all}))
        }
        (Request::Place { positions_m }, Some(engine)) => engine.place(&positions_m).map(|()| json!({})),
        (Request::Table { text, file }, Some(engine)) => {
            fits::table(engine, file_bytes.or(text.as_deref().map(str::as_bytes)), &file)
        }
        (Request::Fit { subject, vowel, baseline, target, walls }, Some(engine)) => {
            let kind: TargetKind = target.parse().map_err(|e| format!("{e}"))?;
            to_value(fits::fit(engine, &subject, &vowel, baseline.as_deref(), kind, walls)?)
        }
        (Request::Spoken { subject, vowel, baseline, target }, Some(engine)) => {
            let kind: TargetKind = target.parse().map_err(|e| format!("{e}"))?;
            fits::spoken(engine, &subject, &vowel, baseline.as_deref(), kind)
        }
        (Request::OpenSpace, Some(engine)) => engine.space().map(|space| space.describe()),
        (Request::MoveInSpace { activations, iterations }, Some(engine)) => {
            engine.space()?.frame(&activations, iterations)
        }
        (Request::SettleInSpace { activations }, Some(engine)) => {
            to_value(engine.space()?.settle(&activations)?)
        }
        (Request::Draws { subject, vowel, baseline, group }, Some(engine)) => {
            let draws = fits::draws(engine, &subject, &vowel, baseline.as_deref(), group)?;
            to_value(draws).map(|draws| json!({"draws": draws}))
        }
        (Request::Verdict { subject, vowel, baseline, draws }, Some(engine)) => {
            fits::verdict(engine, &subject, &vowel, baseline.as_deref(), &draws)
        }
    };
    value.map(|v| v.to_string())
}

fn to_value(record: impl serde::Serialize) -> Result<Value, String> {
    serde_json::to_value(record).map_err(|e| e.to_string())
}
