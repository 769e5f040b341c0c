//! What no command can use is refused in one message with its reason; nothing is printed as a result and no file is left.

use std::fs;

use super::run::{refused_with, run};

/// What stands for files of the repository in the commands.
const PATHS: [(&str, &str); 2] = [
    ("GMSH", concat!(env!("CARGO_MANIFEST_DIR"), "/tests/gmsh")),
    ("RECORDING", concat!(env!("CARGO_MANIFEST_DIR"), "/targets/recordings/synthetic.tsv")),
];

fn with_paths(line: &str) -> String {
    PATHS.iter().fold(line.to_owned(), |line, (word, path)| line.replace(word, path))
}

/// Files that the commands below name.
const FILES: [(&str, &str); 20] = [
    ("bad.toml", "name = 3"),
    ("far.csv", "node,x_mm,y_mm,z_mm\n5000,1,2,3\n"),
    ("short.csv", "node,x_mm,y_mm\n5,1,2\n"),
    ("words.csv", "node,x_mm,y_mm,z_mm\n5,1,two,3\n"),
    ("late.csv", "node,x_mm,y_mm,z_mm,time_s\n5,1,2,3,1\n5,1,2,3,0\n"),
    ("timed.csv", "x_mm,z_mm,time_s\n1,2,0\n"),
    ("doubled.csv", "muscle,length_mm,stretch\nGGP,40,1\n"),
    ("flat.csv", "muscle,stretch\nGGP,0\n"),
    (
        "one.csv",
        "speaker,phoneme,GGa_mm,GGm_mm,SGm_mm,HGa_mm,HGp_mm\nA,ɯ,46,56,25,36,31\nA,ɔ,38,57,21,33,33\n",
    ),
    ("slip.toml", "title = \"t\"\nwant = \"shape\"\n[body.tongue]\n[effects]\nincompresibility = true\n"),
    ("mesh.json", "{}"),
    ("ema.csv", "time_s,point,x_mm,y_mm\n0,T1,1,2\n0,T2,20,12\n"),
    ("three.csv", "time_s,point,x_mm,y_mm\n0,T1,1,2\n0,T2,20,12\n0,T3,30,8\n"),
    ("large.csv", "time_s,point,x_mm,y_mm\n0,T1,10,20\n0,T2,200,120\n0,T3,300,80\n"),
    ("cm.csv", "point,x_mm,y_mm\nmental_spine,0,0\nhyoid,3.76,-0.31\n"),
    ("bones.csv", "point,x_mm,y_mm\nmental_spine,0,0\nhyoid,37.6,-3.1\n"),
    (
        "below.csv",
        "point,x_mm,y_mm\na,45,-10\nb,39,-13\nc,33,-10\nd,27,-13\ne,21,-10\nf,15,-13\ng,9,-10\nh,3,-13\ni,-3,-10\n",
    ),
    ("map.toml", "[points]\nT1 = { surface_mm = 5 }\nT2 = { surface_mm = 25 }\n"),
    ("tiny.toml", "noise_mm = 1e-300\n"),
    ("unit.toml", "title = \"t\"\nwant = \"lengths\"\n[body.mesh]\nfile = \"mesh.json\"\nunit = \"mm\"\n"),
];

#[test]
fn what_cannot_be_used_is_refused_in_one_message_and_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    FILES.iter().for_each(|(name, text)| fs::write(folder.path().join(name), text).unwrap());
    let centimetres: String = tongue_fit::body::REFERENCE
        .lines()
        .map(|line| if line.starts_with('#') { String::new() } else { tenfold_smaller(line) + "\n" })
        .collect();
    fs::write(folder.path().join("cm.toml"), centimetres).unwrap();
    for (line, told) in [
        // Tensions, spacings and settings.
        ("simulate --tension GGa=twelve", "not a number"),
        ("simulate --tension GGa=-1", "not negative"),
        ("simulate --tension GGa=NaN", "finite"),
        ("simulate --tension GGa", "MUSCLE=NEWTONS"),
        ("simulate --tension GGa=1 --tension gga=2", "twice"),
        ("simulate --tension GGx=3", "there is no muscle \"GGx\" in this body; did you mean"),
        ("simulate --tension GGa=1e300", "it must be from 0 to 10000 N"),
        ("simulate --tension GGa=1 --trajectory --dt 1e-308", "1e-308"),
        ("--vowel a --target rato", "did you mean \"ratio\"?"),
        ("--vowel a --h 100", "mm"),
        ("--vowel a --anatomy no/such.toml", "no/such.toml"),
        ("--vowel a --threads 100000", "--threads"),
        ("mesh --h 100mm", "mm"),
        ("mesh --h NaN", "mm"),
        ("mesh --h five", "--h"),
        ("mesh --h 1e308", "spacing 1e308 mm"),
        ("mesh --h 1e-300", "spacing 1e-300 mm"),
        ("mesh --poisson-ratio 1e308", "Poisson's ratio is 1e308; it must be from -0.999999 to 0.4999999"),
        ("muscles --tension 0", "--tension"),
        ("muscles --tension -3", "--tension"),
        ("--vowel a --posterior 7", "--posterior is 7 draws; it must be from 100"),
        ("batch --poisson-ratio nan", "Poisson's ratio"),
        ("batch --poisson-ratio 0.5", "Poisson's ratio"),
        ("batch --poisson-ratio 0", "Poisson's ratio"),
        ("batch --subjects S2 --posterior 99", "--posterior is 99 draws; it must be from 100"),
        ("--vowel a --posterior 1000000", "--posterior is 1000000 draws; it must be from 100 to 200000"),
        ("lengths check .", "cannot read .: it is a folder; name a file in it"),
        ("lengths check one.csv --error-mm -1", "the half width of rounding is -1 mm; give one from 0 to"),
        ("validate --lengths one.csv", "1 subject of one.csv has a row for /ɯ/"),
        // Motions.
        ("simulate --trajectory --t-end 0", "--t-end is 0"),
        ("simulate --trajectory --t-end nan", "--t-end is NaN"),
        ("simulate --trajectory --dt -1", "--dt is -1"),
        ("simulate --trajectory --tolerance 0", "--tolerance is 0"),
        ("simulate --trajectory --ramp -0.1", "--ramp is -0.1"),
        ("simulate --trajectory --t-end 1e-320", "--t-end is 1e-320"),
        ("simulate --trajectory --ramp 1e-320", "--ramp is 1e-320"),
        ("simulate --trajectory --frames 1", "--frames is 1"),
        ("simulate --trajectory --method verlet --dt 1e-3", "beyond the stability limit of verlet, 1.1"),
        ("simulate --trajectory --method verlet --tolerance 1e-3", "verlet has no error control"),
        ("simulate --trajectory --method verlet --t-end 1e4", "take --method tr-bdf2"),
        // Sounds.
        ("sound --tension GGp=150 --tension SGa=60", "there is no airway"),
        ("sound --vowel a --lip-opening 0", "lip_opening_mm"),
        ("sound --vowel a --tract none.toml", "none.toml"),
        ("sound --vowel a --tract bad.toml", "bad.toml:1:"),
        ("sound --vowel a --pitch NaN", "--pitch"),
        ("sound --vowel a --pitch 1e308", "--pitch is 1e308"),
        ("sound --vowel a --seconds 1e9", "--seconds"),
        ("sound --vowel a --hyoid 1", "--hyoid"),
        ("sound --tension GGp", "GGp=20"),
        ("sound --tension GGq=1", "GGp"),
        ("sound --vowel y", "y"),
        // Scenes and meshes.
        ("scene run vowel-x", "unknown scene \"vowel-x\"; did you mean \"vowel-a\"?"),
        ("scene explain missing.toml", "missing.toml"),
        ("scene run slip.toml", "slip.toml:5:1:"),
        ("scene run slip.toml", "did you mean `incompressibility`?"),
        ("scene run unit.toml", "leave out [body.mesh] unit"),
        ("mesh --mesh GMSH/millimetres.msh", "--mesh-unit mm"),
        ("mesh --mesh GMSH/cylinder_41.msh", "[body.mesh] file ="),
        ("mesh --mesh missing.msh", "missing.msh"),
        ("mesh --anatomy cm.toml", "millimetres?"),
        // Recordings.
        ("track", "name at least one recording"),
        ("track none.tsv", "cannot read none.tsv"),
        ("track ema.csv", "--map"),
        ("track large.csv", "unit_mm"),
        ("track ema.csv --map map.toml", "mental spine"),
        ("track ema.csv --map map.toml", "a body that fits the speaker"),
        ("track ema.csv --map tiny.toml", "tiny.toml:1: noise_mm is 1e-300; it must be from 0.001 to 100"),
        ("track three.csv --hold-out T2,T3 --frames 0", "two coils"),
        ("track three.csv --hold-out T9", "there is no such contour point or coil; did you mean \"T1\"?"),
        ("track RECORDING --prior=-1", "--prior is -1"),
        ("track RECORDING --prior 1e300", "--prior is 1e300"),
        ("track RECORDING --memory 1e300", "--memory is 1e300"),
        ("track RECORDING --hold-out 12", "--hold-out 12: there is no such contour point"),
        ("track RECORDING --free-bone hyoid", "it is seen in every recording"),
        ("track RECORDING --free-bone hioid", "the bone \"hioid\" cannot be freed: the bones of this body"),
        ("track RECORDING --muscles GGa,GGa", "GGa is given twice"),
        ("track RECORDING --palate nowhere.csv", "nowhere.csv"),
        ("adapt", "--landmarks"),
        ("adapt --landmarks cm.csv", "0.100 times as large"),
        ("adapt --landmarks bones.csv --contour below.csv", "below the hyoid and the mental spine"),
        // The body in space, and what only the plane has.
        ("simulate --body space --muscles-as lines", "does not have"),
        ("simulate --body space --tension GGP=2", "give activations"),
        ("simulate --body space --filling removed --operate box:1,2,3", "six numbers"),
        ("simulate --body space --filling removed --operate ball:0,0,0,12", "may not remove a bone"),
        ("track --body space far.csv", "node 5000 was seen"),
        ("track --body space short.csv", "no column z_mm"),
        ("track --body space words.csv", "line 2: y_mm is \"two\""),
        ("track --body space late.csv", "sort them by time_s"),
        ("track --body space none.csv", "none.csv"),
        ("track --body space", "name at least one recording"),
        ("track --body space far.csv timed.csv", "in all tables of a recording or in none"),
        ("track --body space doubled.csv", "length_mm and stretch"),
        ("track --body space flat.csv", "line 2: stretch must be positive"),
        ("mesh --body space", "is a body in space"),
        ("muscles --refined", "--refined needs a body in space"),
        ("simulate --body none.msh", "cannot read the mesh"),
        ("simulate --activation GGP=0.1", "--body space"),
        ("simulate --body space --poisson-ratio 0.4", "--poisson-ratio is for bodies in the plane"),
        ("track --body space far.csv --draws 1000", "--draws is for bodies in the plane"),
        ("sound --body space --subject S2", "--subject is for bodies in the plane"),
        ("sound --body space --jaw 3", "--jaw is for bodies in the plane"),
        ("--vowel a --body space --method gauss-newton", "--method is for bodies in the plane"),
        ("track far.csv --sd 0.5", "--sd needs a body in space"),
    ] {
        let message = refused_with(1, folder.path(), &with_paths(line));
        assert!(message.contains(told), "{line}: {message}");
        // A number of hundreds of digits is told in few.
        assert!(
            message.len() < 400 || !["1e308", "1e-30", "1e300"].iter().any(|n| line.contains(n)),
            "{message}"
        );
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let folder = tempfile::tempdir().unwrap();
    for (line, told) in [
        ("--vowl a", "--vowel"),
        ("simulate --tension", ""),
        ("mesh --mesh-unit golden", ""),
        ("mesh --mesh-unit mm", ""),
        ("mesh --mesh GMSH/tongue_41.msh --h 4mm", ""),
        ("mesh --mesh GMSH/tongue_41.msh --anatomy a.toml", ""),
        ("mesh --h -1mm", ""),
        ("--vowel a mesh", "--vowel"),
        ("--h 2.75mm mesh", "--h"),
        ("--method nelder-mead simulate", "--method"),
        ("--vowel a --threads 0", ""),
        ("simulate --method verlett", "a similar value exists: 'verlet'"),
        ("simulate --trajectory --method verlett", "a similar value exists: 'verlet'"),
        ("sound", "--vowel"),
        ("simulate --body space --operate left:box:-20,20,-40,40,15,60", "--filling"),
    ] {
        let message = refused_with(2, folder.path(), &with_paths(line));
        assert!(message.contains(told), "{line}: {message}");
    }
    // No command at all prints the help, and options of every command may stand anywhere.
    let done = run(folder.path(), "");
    assert!(done.status == Some(2) && done.out.is_empty(), "{}", done.err);
    assert_eq!(run(folder.path(), "--threads 1 mesh").status, Some(0));
}

/// The text with every number with a decimal point divided by ten, as in a file of centimetres.
fn tenfold_smaller(line: &str) -> String {
    let ends = &['[', ']', ',', ' ', '='][..];
    let smaller = |word: &str| {
        let number = word.trim_end_matches(ends);
        match number.parse::<f64>() {
            Ok(value) if number.contains('.') => format!("{}{}", value / 10.0, &word[number.len()..]),
            _ => word.to_owned(),
        }
    };
    line.split_inclusive(ends).map(smaller).collect()
}
