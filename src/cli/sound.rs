//! `tongue-fit sound`: the sound of a vowel, or of a tongue in space.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::{Result, bail, ensure};
use tongue_fit::acoustics::{Articulation, Formant, Tract, VocalTract, mean_vowels};
use tongue_fit::inner::report::{self, Export, Json, Rows, SoundRecord, Wav};
use tongue_fit::inner::run::{Kind, SpaceSource, TongueSound};
use tongue_fit::inner::scene::effects::Effects;
use tongue_fit::inner::scene::file::{FitTarget, Material, SceneTongue, SceneTract};
use tongue_fit::measured::{Dataset, Vowel};
use tongue_fit::scene::{Scene, SceneBody, Want};
use tongue_sound::voice::{self, Voice};

use super::body::space_name;
use super::{Global, Outcome, drive, inputs, output, space, table};

const IN_SPACE: &str = "Body in space";

#[derive(Debug, Clone, clap::Args)]
#[command(
    allow_negative_numbers = true,
    after_help = "Examples:\n  \
    tongue-fit sound --vowel a\n  \
    tongue-fit sound --tension GGp=20 --tension SGa=4 --lip-opening 7 --out results/mine\n  \
    tongue-fit sound --body space --activation GGP=0.1"
)]
pub struct Arguments {
    /// Vowel whose lengths are fitted, with jaw and lips as in the tract's file; for the baseline ɯ the tongue at rest
    #[arg(long, value_name = "V", required_unless_present_any = ["tension", "body"], conflicts_with = "tension")]
    vowel: Option<String>,
    /// Subject whose lengths are fitted
    #[arg(long, value_name = "NAME", default_value = "S2", conflicts_with = "tension")]
    subject: String,
    /// Quantity to fit: ratio (to GGa) or stretch (to the subject's own /ɯ/)
    #[arg(long, value_name = "KIND", default_value = "stretch", conflicts_with = "tension")]
    #[arg(hide_short_help = true)]
    target: String,
    /// Tension of a muscle instead of a vowel, N per metre of thickness; may be given several times
    #[arg(long, value_name = "MUSCLE=N")]
    tension: Vec<String>,
    /// Tract (TOML) instead of that of the reference tongue
    #[arg(long, value_name = "FILE")]
    tract: Option<PathBuf>,
    /// Opening of the jaw, degrees [default: that of the tract's file for the vowel, else 0]
    #[arg(long, value_name = "DEG")]
    jaw: Option<f64>,
    /// Shift of the hyoid, mm: back,up
    #[arg(long, value_name = "X,Y", value_delimiter = ',', allow_hyphen_values = true)]
    #[arg(hide_short_help = true)]
    hyoid: Option<Vec<f64>>,
    /// Height of the opening between the lips, mm [default: that of the tract's file for the vowel, else 8]
    #[arg(long, value_name = "MM")]
    lip_opening: Option<f64>,
    /// Protrusion of the lips, mm [default: that of the tract's file for the vowel, else 0]
    #[arg(long, value_name = "MM")]
    lip_protrusion: Option<f64>,
    /// Mesh spacing, mm
    #[arg(long, value_name = "MM", default_value_t = 5.5, hide_short_help = true)]
    h: f64,
    /// Pitch of the voice, Hz
    #[arg(long, value_name = "HZ", default_value_t = Voice::default().pitch_hz, hide_short_help = true)]
    pitch: f64,
    /// Duration of the voice, s
    #[arg(long, value_name = "S", default_value_t = Voice::default().seconds, hide_short_help = true)]
    seconds: f64,
    /// Tongue in space instead of a vowel: the built-in one, a folder with ArtiSynth's, or hexahedra from Gmsh [space, FOLDER, FILE.msh]
    #[arg(long, value_name = "BODY", value_parser = space_name, conflicts_with_all = ["vowel", "tension"], help_heading = IN_SPACE)]
    body: Option<SpaceSource>,
    /// Activation of a muscle, from 0 to 1: of both sides (GGP=0.1) or of one (GGP_L=0.1); may be given several times
    #[arg(long, value_name = "MUSCLE=A", requires = "body", help_heading = IN_SPACE)]
    activation: Vec<String>,
    #[command(flatten)]
    model: space::ModelArguments,
}

impl Arguments {
    fn check(&self) -> Result<()> {
        let Self { pitch, seconds, hyoid, .. } = self;
        ensure!((40.0..=1000.0).contains(pitch), "--pitch is {pitch}; it must be between 40 and 1000 Hz");
        ensure!((0.05..=60.0).contains(seconds), "--seconds is {seconds}; it must be between 0.05 and 60");
        let has_two = hyoid.as_ref().is_none_or(|shift| shift.len() == 2);
        ensure!(has_two, "--hyoid takes two numbers, such as --hyoid 2,-3");
        Ok(())
    }

    /// The vowel with the label of its row in the table, by which the tract's file and the published means name it.
    fn vowel(&self) -> Result<Option<Vowel>> {
        let Some(label) = &self.vowel else { return Ok(None) };
        let (vowel, data) = (label.parse()?, Dataset::reference()?);
        Ok(Some(data.row(&self.subject, &vowel).map_or(vowel, |row| row.vowel.clone())))
    }

    /// Jaw, hyoid and lips; what is not given is taken from the tract's file for the vowel.
    fn posture(&self, tract: &Tract, vowel: Option<&Vowel>) -> Articulation {
        let drawn = vowel.and_then(|vowel| {
            let mut all = tract.posture.iter();
            let like = all.find(|(key, _)| key.parse().is_ok_and(|key: Vowel| key.is_like(vowel)));
            tract.posture.get(vowel.label()).or(like.map(|(_, posture)| posture))
        });
        let drawn = drawn.copied().unwrap_or_default();
        Articulation {
            jaw_deg: self.jaw.unwrap_or(drawn.jaw_deg),
            hyoid_mm: self.hyoid.as_deref().and_then(|h| h.try_into().ok()).unwrap_or(drawn.hyoid_mm),
            lip_opening_mm: self.lip_opening.unwrap_or(drawn.lip_opening_mm),
            lip_protrusion_mm: self.lip_protrusion.unwrap_or(drawn.lip_protrusion_mm),
        }
    }

    /// The scene of given tensions, or of a vowel whose lengths are fitted. The baseline is the body at rest.
    fn scene(&self, tract: &Tract, vowel: Option<&Vowel>) -> Result<Scene> {
        let fit = vowel.filter(|v| **v != Vowel::unrounded_u()).map(|v| FitTarget {
            subject: self.subject.clone(),
            vowel: v.label().to_owned(),
            target: self.target.clone(),
        });
        let file = self.tract.as_ref().map(|p| p.display().to_string());
        let scene = Scene {
            title: vowel.map_or_else(|| self.tension.join(", "), |v| format!("{} /{v}/", self.subject)),
            note: String::new(),
            want: Want::Sound,
            body: SceneBody::Tongue(SceneTongue { h_mm: self.h, kind: Kind::Springs }),
            material: Material::default(),
            tensions_n: drive::pairs("--tension", &self.tension, "GGp=20")?.into_iter().collect(),
            fit,
            activations: BTreeMap::new(),
            surgery: None,
            points: None,
            effects: Effects::default(),
            trajectory: None,
            tract: Some(SceneTract { file, ..SceneTract::default() }),
        };
        let scene = scene.spoken(&self.posture(tract, vowel), tract.jaw.joint_mm);
        scene.check()?;
        Ok(scene)
    }
}

pub fn run(arguments: &Arguments, global: &Global) -> Result<Outcome> {
    arguments.check()?;
    let vowel = arguments.vowel()?;
    let source = arguments.body.as_ref();
    let means = mean_vowels()?;
    let tract = match (&arguments.tract, source) {
        (Some(path), _) => inputs::tract(path)?,
        (None, None | Some(SpaceSource::BuiltIn)) => VocalTract::reference()?,
        (None, Some(SpaceSource::Folder(path) | SpaceSource::Mesh(path))) => bail!(
            "the built-in tract fits the built-in tongue only; give a tract in the frame of {} with --tract",
            path.display()
        ),
    };
    let (out, title, found) = match source {
        Some(source) => {
            let Arguments { activation, model, .. } = arguments;
            let (body, posture) = (model.body(source)?, arguments.posture(&tract, None));
            let activations = space::activations(activation, &body)?;
            let (tract_and_means, model) = ((&tract, posture, means.as_slice()), model.model()?);
            let sound =
                TongueSound::in_space((&body, &model), activations, tract_and_means, &output::tell_step)?;
            let shown = if activation.is_empty() { "at rest".to_owned() } else { activation.join(", ") };
            (global.folder("results/sound")?, format!("{}, {shown}", body.what), sound)
        }
        None => {
            let scene = arguments.scene(&tract, vowel.as_ref())?;
            let out = global.folder("results/sound")?;
            let spoken = vowel.as_ref().map(|v| (arguments.subject.as_str(), v));
            let sound = TongueSound::of_scene(&scene, spoken, &means)?;
            (out, scene.title, sound)
        }
    };
    let title_of_picture =
        format!("{title}: {}", if source.is_some() { "its sound" } else { "the sound of the vowel" });
    let picture = report::vowel(&found.mesh, &found.positions, &found.sound, &means, &title_of_picture)?;
    let formants: Vec<Formant> = (found.sound.formants_hz.iter().zip(&found.sound.bandwidths_hz))
        .map(|(&frequency_hz, &bandwidth_hz)| Formant { frequency_hz, bandwidth_hz })
        .collect();
    let spoken = Voice { pitch_hz: arguments.pitch, seconds: arguments.seconds };
    let wav = Wav { samples: voice::samples(&formants, &spoken), rate_hz: voice::RATE_HZ };
    let by = super::provenance().with_tissue(found.tissue);
    let stem = vowel.as_ref().map_or("sound", Vowel::label);
    let names = ["json", "wav", "svg", "csv"].map(|extension| format!("{stem}.{extension}"));
    let (json, areas) = (Json(&found), Rows(&found.sound.area_function));
    let files: [(&str, &dyn Export); 4] =
        [(&names[0], &json), (&names[1], &wav), (&names[2], &picture), (&names[3], &areas)];
    output::write_and_answer(global, (Some(&out), &files), &json, &by, || text(&found, &title))?;
    let failed = (!found.converged).then(|| "the shape of the tongue did not converge".to_owned());
    Ok(Outcome::of_alarms(failed, &found.alarms))
}

fn text(found: &TongueSound, title: &str) -> String {
    let sound = &found.sound;
    let mut text = format!("{title}: {}\n", sound.tract);
    let p = &sound.posture;
    let _ = writeln!(
        text,
        "jaw opened by {} degrees, hyoid {} mm back and {} mm up, lips opened by {} mm and protruded by {} mm; {:.0} mm from glottis to lips\n",
        p.jaw_deg, p.hyoid_mm[0], p.hyoid_mm[1], p.lip_opening_mm, p.lip_protrusion_mm, sound.tract_length_mm
    );
    text += &formants(sound, found.published_hz);
    if !found.converged {
        text += "NOT CONVERGED (do not trust the shape)\n";
    }
    text += &table::alarms(&found.alarms);
    if let Some(nearest) = &found.nearest_vowel {
        let _ = writeln!(
            text,
            "nearest published mean of Japanese men: /{nearest}/ (distance of F1 and F2 in Bark)"
        );
    }
    text + "walls are another speaker's, jaw and lips estimated: docs/sound.md says what that does to formants\n\n"
}

/// A table of the formants of a sound, with the published means of the first ones.
pub fn formants(sound: &SoundRecord, published_hz: Option<[f64; 2]>) -> String {
    let muscles = sound.by_tension.iter().map(|b| format!("by {} Hz per N/m", b.muscle));
    let columns = ["formant", "Hz", "bandwidth Hz", "published Hz"].map(str::to_owned).into_iter();
    let columns: Vec<String> = columns.chain(muscles).collect();
    let formants = sound.formants_hz.iter().zip(&sound.bandwidths_hz).enumerate();
    let t = table::rows(&columns, formants, |(i, (f, b))| {
        let mean = published_hz.and_then(|m| m.get(i).copied());
        let rates = sound.by_tension.iter().map(|b| format!("{:+.2}", b.hz_per_n[i]));
        let own = [
            format!("F{}", i + 1),
            format!("{f:.0}"),
            format!("{b:.0}"),
            mean.map_or_else(|| "-".to_owned(), |m| format!("{m:.0}")),
        ];
        own.into_iter().chain(rates).collect::<Vec<_>>()
    });
    format!("{t}\n\n")
}
