//! Lips, incisors and coils on the jaw beside coils on the tongue: they tell which way is up and to the front, and which coils are exchanged.

use tongue_core::geometry::Point;

use super::channels::{median_place, median_x};
use super::measures::FEW;
use super::{Map, names};

/// Differences below this mean nothing, m.
const APART_M: f64 = 5e-3;
/// A coil on the jaw is at the lower incisors and in front of the tongue's first coil, which lies behind the tip: it is not farther
/// behind that one than this, m.
const BEHIND_M: f64 = 3e-3;
/// When the tongue is low, its first coil lies at about the height of the lower incisors, 2 to 8 mm above the coil below them; farther
/// above or below it than this, m, the two are not in one frame.
const APART_IN_HEIGHT_M: f64 = 15e-3;

/// A recording of coils without a contour, x to the back of the head.
pub(super) struct Front<'a> {
    pub channels: &'a [String],
    pub places: &'a [Vec<Option<Point>>],
    pub map: &'a Map,
}

impl Front<'_> {
    /// Adds what is doubtful to `notes`. `sensors`: the coils on the tongue from the tip backwards; `bones`: those on the jaw.
    pub fn check(&self, sensors: &[usize], bones: &[usize], notes: &mut Vec<String>) -> Result<(), String> {
        if let Some(problem) = self.lips(sensors) {
            return Err(problem);
        }
        if let Some(&first) = sensors.first() {
            notes
                .extend(self.behind(first).or_else(|| bones.iter().find_map(|&jaw| self.height(first, jaw))));
        }
        Ok(())
    }

    /// The channels whose meaning is taken from their names alone: those that the map does not name.
    fn judged(&self) -> impl Iterator<Item = usize> {
        (0..self.channels.len()).filter(|&c| !self.map.names(&self.channels[c]))
    }

    /// The problem of coils that lie in front of lips, incisors and jaw, or of lips that are upside down.
    fn lips(&self, sensors: &[usize]) -> Option<String> {
        let [upper, lower] = [true, false].map(|upper| {
            let found = self.judged().find(|&c| names::lip(&self.channels[c]) == Some(upper));
            found.and_then(|c| Some((&self.channels[c], median_place(self.places, c)?)))
        });
        if let Some(((upper, a), (lower, b))) = upper.zip(lower)
            && a.y < b.y - APART_M
        {
            let what = format!("{upper} lies below {lower}: the recording is upside down");
            return Some(format!("{what}; give the axis that grows upwards in a map, such as up = \"-y\""));
        }
        let (tip, rear) =
            (median_x(self.places, *sensors.first()?)?, median_x(self.places, *sensors.last()?)?);
        let front = self.judged().filter(|&c| names::is_in_front(&self.channels[c]));
        let (name, at) =
            front.filter_map(|c| Some((&self.channels[c], median_place(self.places, c)?))).next()?;
        (sensors.len() > 1 && (at.x - tip).abs() > (at.x - rear).abs() + APART_M).then(|| {
            format!(
                "{name} is nearer to the rear coil than to the one at the tip: the coils are exchanged, or the axis is; correct their \
                 names, or back in a map"
            )
        })
    }

    /// A note where coils of lips, incisors or jaw lie behind the first coil on the tongue.
    fn behind(&self, first: usize) -> Option<String> {
        let x = |c: usize| median_x(self.places, c);
        let front = self.judged().filter(|&c| names::is_in_front(&self.channels[c]));
        let all = front.filter_map(|c| Some((self.channels[c].as_str(), x(c)? - x(first)?)));
        let (names, behind): (Vec<&str>, Vec<f64>) = all.filter(|(_, behind)| *behind > BEHIND_M).unzip();
        (!names.is_empty()).then(|| {
            format!(
                "{} seen {:.0} mm behind {}, the first coil on the tongue, which seems to be exchanged with {}; correct their names, or say \
                 in a map what they are",
                names.join(" and ") + if names.len() > 1 { " are" } else { " is" },
                behind.iter().fold(0.0, |a: f64, b| a.max(*b)) * 1e3,
                self.channels[first],
                if names.len() > 1 { "one of them" } else { "it" }
            )
        })
    }

    /// A note where the first coil on the tongue always lies far above or below a coil on the jaw.
    fn height(&self, first: usize, jaw: usize) -> Option<String> {
        let (tongue, name) = (&self.channels[first], &self.channels[jaw]);
        let mut above: Vec<f64> = self.places.iter().filter_map(|f| Some(f[first]?.y - f[jaw]?.y)).collect();
        above.sort_unstable_by(f64::total_cmp);
        let (low, high) = (*above.get(above.len() / 10)?, *above.get(above.len() * 9 / 10)?);
        let (off, side, even) =
            if low > APART_IN_HEIGHT_M { (low, "above", "lowest") } else { (-high, "below", "highest") };
        (above.len() >= FEW && off > APART_IN_HEIGHT_M).then(|| {
            format!(
                "{tongue} lies {:.0} mm {side} {name}, a coil on the jaw, even where it is {even}: the coils of tongue and jaw do not seem to \
                 be in one frame; compare both with a picture, or write \"{name}\" = \"ignore\" into a map",
                off * 1e3
            )
        })
    }
}
