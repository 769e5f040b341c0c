//! Runs from options: the same as what the parts of the library make, and the same after a way through JSON.

use tongue_fit::body::json::MeshRecord;
use tongue_fit::body::{Body, ContinuumSettings, MeshContent};
use tongue_fit::inverse::{FitSettings, Method, fit};
use tongue_fit::measured::{Dataset, Target, TargetKind, TargetOptions};
use tongue_fit::report::Provenance;
use tongue_fit::run::{BodySource, FitRun, Kind, PlaneBody};
use tongue_fit::system::Model;

fn made(plane: &PlaneBody) -> Body<2> {
    let text = serde_json::to_string(plane).unwrap();
    let read: PlaneBody = serde_json::from_str(&text).unwrap();
    assert_eq!(&read, plane);
    read.make(&mut |concern| panic!("{concern}")).unwrap()
}

#[test]
fn a_body_from_options_is_that_of_the_library() {
    assert_eq!(made(&PlaneBody::default()), Body::tongue(5.5e-3).unwrap());
    let (kind, settings) = (Kind::Continuum, ContinuumSettings::default());
    assert_eq!(made(&PlaneBody { kind, ..PlaneBody::default() }), Body::continuum(4e-3, &settings).unwrap());
    let toml = include_str!("../../targets/anatomy.toml").to_owned();
    let source = BodySource::Anatomy { toml, origin: "anatomy.toml".to_owned() };
    let of_text = made(&PlaneBody { source, spacing_m: Some(7e-3), ..PlaneBody::default() });
    let tongue = Body::tongue(7e-3).unwrap();
    assert_eq!(of_text.mesh, tongue.mesh);
    let text = serde_json::to_string(&MeshRecord::of(&tongue, &Model::default()).unwrap()).unwrap();
    let source = BodySource::Mesh { content: MeshContent::Json(text), origin: "tongue.json".to_owned() };
    assert_eq!(made(&PlaneBody { source, ..PlaneBody::default() }).mesh, tongue.mesh);
}

#[test]
fn an_anatomy_that_cannot_be_meshed_is_named() {
    let toml = include_str!("../../targets/anatomy.toml").to_owned();
    let source = BodySource::Anatomy { toml, origin: "mine.toml".to_owned() };
    let plane = PlaneBody { source, spacing_m: Some(-1.0), ..PlaneBody::default() };
    let message = plane.make(&mut |_| ()).unwrap_err().to_string();
    assert!(message.starts_with("mine.toml: "), "{message}");
}

#[test]
fn a_fit_from_options_is_that_of_the_inverse_problem() {
    let data = Dataset::reference().unwrap();
    let kind = TargetKind::Stretch;
    let target = Target::new(&data, "S2", &"a".parse().unwrap(), kind, &TargetOptions::default()).unwrap();
    let (body, model) = (Body::tongue(5.5e-3).unwrap(), Model::default());
    let found = FitRun::quick(target.clone(), false).run(&body, &model, &Provenance::new("")).unwrap();
    let settings = FitSettings { method: Method::GaussNewton, ..FitSettings::default() };
    assert_eq!(found.fit, fit(&body.mesh, &model, &target, &settings).unwrap());
}
