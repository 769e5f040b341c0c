//! Template of a map: every channel of a recording with its likely role, its position and its motion.

use std::fmt::Write as _;

use tongue_core::statistics::upper_median;

use super::{Map, Recording, Role, Times};

impl Map {
    /// A map (TOML) for a recording, for its user to correct: with the roles that the names of channels
    /// suggest, and the position and motion of every channel in comments.
    pub fn template(recording: &Recording) -> String {
        let map = Self::default();
        let name = recording.name.replace(char::is_control, " ");
        let what = "millimetres in a unit of the file";
        let unit = match (recording.metres, map.metres(recording)) {
            (Some(metres), _) => format!("# unit_mm = {}  # {what}: the format says it", metres * 1e3),
            (None, Ok((metres, _))) => {
                format!("unit_mm = {}  # {what}: guessed from the way from coil to coil", metres * 1e3)
            }
            (None, Err(_)) => format!("unit_mm = 1.0  # {what} (in a pixel): WRITE YOURS"),
        };
        let rate = match recording.times {
            Times::InFile => "# The file has its own times: no rate_hz.".to_owned(),
            Times::Usual(hz) => format!("# rate_hz = {hz}  # frames a second: usual with this instrument"),
            Times::Frames => "rate_hz = 60.0  # frames a second: WRITE YOURS".to_owned(),
        };
        let (_, up) = map.axes(recording.format, false);
        let mut text = format!(
            "# The meaning of the channels of \"{name}\"; give this file with --map.\n\
             # Lines that begin with # are not read: remove the # of a line that is needed.\n\n{unit}\n{rate}\n\
             # back = \"x\"  # the axis that grows to the back of the head (x, y, z, -x, -y, -z), where it is not found\n\
             # up = \"{}\"  # the axis that grows upwards\n",
            ["x", "y", "z"][up.0]
        );
        text += "# contour_frame = \"bones\"  # the frame of the contour; \"hyoid\": origin at the hyoid of each sample, x towards the mandible\n";
        text += "# noise_mm = 0.5  # standard deviation of a point\n\
                 # scale = 1.0  # these three bring the recording into the body's frame: multiplied,\n\
                 # turn_deg = 0.0  # turned (from the axis to the back towards the one upwards),\n\
                 # shift_mm = [0.0, 0.0]  # and shifted (to the back, upwards); without shift_mm the program places the body\n\n\
                 # A point can be:\n\
                 #   \"coil\"                  a sensor glued to the tongue; { coil = 1 } for the first from the tip, 2 for the next\n\
                 #   { surface_mm = 10.0 }   a sensor so far behind the tip, measured along the tongue at rest\n\
                 #   \"contour\"               somewhere on the surface of the tongue\n\
                 #   { bone = \"hyoid\" }      moves with this bone of the body (hyoid, mental_spine)\n\
                 #   \"reference\"             moves with the head alone: every frame is brought back to where it was\n\
                 #   \"ignore\"                not used\n\
                 # In braces also noise_mm = 0.3, the standard deviation of this point.\n[points]\n";
        let roles = map.roles(&recording.channels);
        for (nth, (channel, role)) in recording.channels.iter().zip(roles).enumerate() {
            let key = toml::Value::String(channel.clone());
            let role = match role {
                Role::Contour => "\"contour\"".to_owned(),
                Role::Coil(_) => "\"coil\"".to_owned(),
                Role::Bone(bone) => format!("{{ bone = \"{bone}\" }}"),
                _ => "\"ignore\"".to_owned(),
            };
            let _ = writeln!(text, "{key} = {role}  # {}", course(recording, nth));
        }
        text
    }
}

/// Position of a channel in the middle of the recording, and how far it moves, in the unit of the file.
fn course(recording: &Recording, channel: usize) -> String {
    let places = || recording.samples.iter().filter_map(|s| s.places[channel]);
    let middle: Option<Vec<f64>> = (0..3).map(|axis| upper_median(places().map(|p| p[axis]))).collect();
    let Some(middle) = middle else { return "never seen".to_owned() };
    let away = places().map(|p| (0..3).map(|a| (p[a] - middle[a]).powi(2)).sum::<f64>().sqrt());
    let moves = upper_median(away).unwrap_or(0.0);
    let (count, missing) = (recording.samples.len(), recording.samples.len() - places().count());
    let gone = if missing > 0 { format!(", not seen in {missing} of {count} frames") } else { String::new() };
    let [x, y, z] = [middle[0], middle[1], middle[2]];
    format!("at x {x:.4}, y {y:.4}, z {z:.4}, half of the time within {moves:.3} of there{gone}")
}
