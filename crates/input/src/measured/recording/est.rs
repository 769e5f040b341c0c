//! Edinburgh Speech Tools' tracks (`.ema`): header lines from `EST_File Track` to `EST_Header_End`, then for each frame its time (s), a
//! flag if breaks are present (0: nothing seen), and the channels, as 32-bit floats or as text. After `EST_TrackFile.cc`,
//! `save_est_binary_ts` and `save_est_ts`.

use std::collections::BTreeMap;

use super::limits::LARGEST_HEADER;
use super::{
    Budget, Format, MOST_CHANNELS, Malformed, Recording, Sample, SourcePlace, is_coordinate, numbers, seen,
};

const AXES: [[&str; 2]; 3] = [["x", "px"], ["y", "py"], ["z", "pz"]];
const END: &[u8] = b"EST_Header_End";

#[derive(Default)]
struct EstHeader {
    ascii: bool,
    big_endian: bool,
    frames: usize,
    breaks: bool,
    names: Vec<String>,
    size: usize,
}

pub(super) fn read(bytes: &[u8], origin: &str) -> Result<Recording, Malformed> {
    let start = SourcePlace::start(origin);
    let first = bytes.iter().find(|b| !b.is_ascii_whitespace());
    if first.is_some_and(|b| b.is_ascii_digit() || b"-+.N".contains(b)) {
        return numbers::read_mocha(bytes, origin);
    }
    let header = header(bytes, start)?;
    let before = 1 + usize::from(header.breaks);
    let width = before + header.names.len();
    Budget::default().add_recording(header.frames, width, start)?;
    let axes = axes(&header.names);
    let body = &bytes[header.size..];
    let rows: Vec<Vec<f64>> = if header.ascii {
        let first_line = 1 + bytes[..header.size].iter().filter(|b| **b == b'\n').count() as u64;
        let at = SourcePlace { line: first_line, ..start };
        let cut = "the file is cut off; copy it again";
        let content = body.trim_ascii_end();
        if !content.is_empty() && !body[content.len()..].contains(&b'\n') {
            return Err(at.error("the last line does not end in a line end", cut));
        }
        let rows = numbers::number_rows(body, at, &[width], "write numbers, separated by blanks")?;
        let frames = rows.len();
        if frames < header.frames {
            return Err(at.error(format!("{frames} of {} frames follow the header", header.frames), cut));
        }
        if frames > header.frames {
            let what = format!("more than {} frames follow the header", header.frames);
            return Err(at.error(what, "correct NumFrames"));
        }
        rows.into_iter().map(|(_, row)| row).collect()
    } else {
        let wanted = header.frames * width * 4;
        if body.len() < wanted {
            let what = format!("{} bytes follow the header where {wanted} are needed", body.len());
            return Err(start.error(what, "the file is cut off; copy it again"));
        }
        let of = if header.big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
        let (numbers, _) = body[..wanted].as_chunks();
        numbers.chunks_exact(width).map(|row| row.iter().map(|n| f64::from(of(*n))).collect()).collect()
    };
    let mut samples: Vec<Sample> = Vec::with_capacity(header.frames);
    for (n, row) in rows.iter().enumerate() {
        let time_s = row[0];
        let after = samples.last().is_none_or(|last| last.time_s < time_s);
        if !is_coordinate(time_s) || !after {
            let what = format!("the time of frame {n} is {time_s} s");
            return Err(start.error(what, "times must be finite and ascending; copy the file again"));
        }
        let is_seen = !header.breaks || row[1] != 0.0;
        let places = axes.iter().map(|(_, channels)| {
            seen(channels.map(|c| c.map_or(0.0, |c| row[before + c]))).filter(|_| is_seen)
        });
        samples.push(Sample::new(time_s, places.collect()));
    }
    Ok(Recording::of_file(origin, Format::Est, None, axes.into_iter().map(|(name, _)| name), samples))
}

fn header(bytes: &[u8], start: SourcePlace<'_>) -> Result<EstHeader, Malformed> {
    let head = &bytes[..bytes.len().min(LARGEST_HEADER)];
    let end = head.windows(END.len()).position(|w| w == END).ok_or_else(|| {
        start.error("there is no line EST_Header_End", "give a track of the Edinburgh Speech Tools (.ema)")
    })?;
    let size = head[end..].iter().position(|b| *b == b'\n').map_or(head.len(), |n| end + n + 1);
    let mut header = EstHeader { size, ..EstHeader::default() };
    let (mut channels, mut given) = (0, BTreeMap::<usize, String>::new());
    let text = String::from_utf8_lossy(&head[..end]);
    for (line, text) in (1..).zip(text.lines()) {
        let (key, value) = text.trim().split_once(char::is_whitespace).unwrap_or((text.trim(), ""));
        let value = value.trim();
        let wrong = |what: String, help: &str| SourcePlace { line, ..start }.error(what, help);
        let count = |most: usize| match value.parse::<usize>().ok().filter(|v| *v <= most) {
            Some(number) => Ok(number),
            None => Err(wrong(format!("{key} is {value:?}"), &format!("it must be at most {most}"))),
        };
        match key {
            "EST_File" if value != "Track" => {
                return Err(wrong(format!("the file is EST's {value:?}"), "give a track"));
            }
            "DataType" if !matches!(value, "ascii" | "binary") => {
                return Err(wrong(format!("the data type is {value:?}"), "give ascii or binary"));
            }
            "DataType" => header.ascii = value == "ascii",
            "ByteOrder" => header.big_endian = value == "10",
            "NumFrames" => header.frames = count(super::MOST_FRAMES)?,
            "NumChannels" => channels = count(MOST_CHANNELS)?,
            "BreaksPresent" => header.breaks = value.eq_ignore_ascii_case("true"),
            _ => {
                if let Some(number) = key.strip_prefix("Channel_").and_then(|n| n.parse().ok()) {
                    given.entry(number).or_insert_with(|| value.to_owned());
                }
            }
        }
    }
    header.names =
        (0..channels).map(|n| given.remove(&n).unwrap_or_else(|| format!("channel_{n}"))).collect();
    Ok(header)
}

/// Points with at least two channels named as `T1_px`, `T1_py` (mngu0) or `tt_x`, `tt_y` (MOCHA); other channels are ignored.
fn axes(names: &[String]) -> Vec<(String, [Option<usize>; 3])> {
    let mut points: Vec<(String, [Option<usize>; 3])> = Vec::new();
    for (channel, name) in names.iter().enumerate() {
        let Some((point, axis)) = name.rsplit_once('_') else { continue };
        let Some(axis) = AXES.iter().position(|names| names.contains(&axis)) else { continue };
        if points.iter().all(|(p, _)| p != point) {
            points.push((point.to_owned(), [None; 3]));
        }
        points.iter_mut().filter(|(p, _)| p == point).for_each(|(_, axes)| axes[axis] = Some(channel));
    }
    points.retain(|(_, axes)| axes.iter().flatten().count() >= 2);
    points
}
