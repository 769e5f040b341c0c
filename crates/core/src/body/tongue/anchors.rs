//! The nodes that the anatomy requires: ends of muscles, crossings of muscles, bones, and the places where muscles enter the tissue.

use super::anatomy::{Anatomy, MuscleLine, ON_OUTLINE_M, SAME_POINT_M};
use crate::geometry::plane::{self, Point};
use crate::statistics::least_by;

/// Crossings that are nearer than this to another anchor of either line become that anchor, in mesh spacings.
const MERGE_DISTANCE: f64 = 0.4;
/// Other crossings keep this distance from an anchor, in mesh spacings, because much shorter connections would be much stiffer than the
/// tissue around them.
const LEAST_DISTANCE: f64 = 0.5;

/// Points that must be nodes.
#[derive(Default)]
pub(crate) struct Anchors {
    /// Positions, m.
    pub points: Vec<Point>,
    /// Anchors on the outline, by distance along it (m), ascending.
    pub on_outline: Vec<(f64, usize)>,
    /// The anchors of every muscle from its first end to its second.
    pub stations: Vec<Vec<usize>>,
    pub fixed: Vec<usize>,
}

impl Anchors {
    /// The anchors for a mesh spacing `h`, m.
    pub fn find(anatomy: &Anatomy, h: f64) -> Self {
        let lines = anatomy.muscles();
        let mut anchors = Self::default();
        for line in lines {
            let ends = line.ends.map(|end| anchors.at(end, SAME_POINT_M));
            anchors.stations.push(ends.to_vec());
        }
        for bone in anatomy.bones() {
            for point in &bone.points {
                let anchor = anchors.at(*point, SAME_POINT_M);
                anchors.fixed.push(anchor);
            }
        }
        anchors.fixed.sort_unstable();
        anchors.fixed.dedup();
        for anchor in 0..anchors.points.len() {
            anchors.put_on_outline(anatomy, anchor);
        }
        for (m, line) in lines.iter().enumerate() {
            anchors.enter(anatomy, line, m, h);
        }
        for a in 0..lines.len() {
            for b in a + 1..lines.len() {
                anchors.cross(lines, a, b, h);
            }
        }
        anchors.on_outline.sort_by(|a, b| a.0.total_cmp(&b.0));
        anchors
    }

    /// The anchor within `reach` of `point`, m; a new one if there is none.
    fn at(&mut self, point: Point, reach: f64) -> usize {
        let near = self.points.iter().position(|p| (p - point).norm() < reach);
        near.unwrap_or_else(|| self.add(point))
    }

    fn add(&mut self, point: Point) -> usize {
        self.points.push(point);
        self.points.len() - 1
    }

    fn put_on_outline(&mut self, anatomy: &Anatomy, anchor: usize) {
        let (along, away) = anatomy.outline().nearest(self.points[anchor]);
        if away < ON_OUTLINE_M {
            self.on_outline.push((along, anchor));
        }
    }

    /// Adds the anchor at which a muscle from outside enters the tissue: one on the outline if it is near.
    fn enter(&mut self, anatomy: &Anatomy, line: &MuscleLine, muscle: usize, h: f64) {
        let Some(outside) = line.outside else { return };
        let away = |anchor: &usize| (self.points[*anchor] - outside.entry).norm();
        let nearest = least_by(self.on_outline.iter().map(|(_, anchor)| *anchor), away);
        let anchor = nearest.filter(|near| away(near) < LEAST_DISTANCE * h).unwrap_or_else(|| {
            let anchor = self.add(outside.entry);
            self.put_on_outline(anatomy, anchor);
            anchor
        });
        self.station(line, muscle, anchor);
    }

    /// Adds the common anchor of two lines that cross or touch.
    fn cross(&mut self, lines: &[MuscleLine], a: usize, b: usize, h: f64) {
        let (first, second) = (&lines[a], &lines[b]);
        if self.stations[a].iter().any(|s| self.stations[b].contains(s)) {
            return;
        }
        let Some(fractions) = plane::crossing(first.ends, second.ends) else { return };
        if !reaches(first, fractions[0]) || !reaches(second, fractions[1]) {
            return;
        }
        let place = first.ends[0] + (first.ends[1] - first.ends[0]) * fractions[0];
        let away = |anchor: &usize| (self.points[*anchor] - place).norm();
        let stations = [a, b].map(|m| &self.stations[m]).into_iter().flatten();
        let nearest = least_by(stations.copied(), away);
        let anchor = match nearest.map(|near| (near, away(&near))) {
            Some((near, distance)) if distance < MERGE_DISTANCE * h => near,
            Some((near, distance)) if distance < LEAST_DISTANCE * h => {
                let from = self.points[near];
                self.add(from + (place - from) * (LEAST_DISTANCE * h / distance))
            }
            _ => self.add(place),
        };
        self.station(first, a, anchor);
        self.station(second, b, anchor);
    }

    /// Adds an anchor to a muscle, in its place between the ends.
    fn station(&mut self, line: &MuscleLine, muscle: usize, anchor: usize) {
        let stations = &mut self.stations[muscle];
        if stations.contains(&anchor) {
            return;
        }
        let along = |p: Point| (p - line.ends[0]).dot(&(line.ends[1] - line.ends[0]));
        let t = along(self.points[anchor]);
        let last = stations.len() - 1;
        let place = stations[1..last].iter().filter(|s| along(self.points[**s]) < t).count() + 1;
        stations.insert(place, anchor);
    }
}

fn reaches(line: &MuscleLine, t: f64) -> bool {
    let slack = SAME_POINT_M / (line.ends[1] - line.ends[0]).norm();
    (-slack..=1.0 + slack).contains(&t)
}
