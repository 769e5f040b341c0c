"""Prints the formants that Praat finds in a WAV file, Hz, as JSON: medians over the steady part, with Praat's usual settings for men."""
import json, statistics, sys

import parselmouth

sound = parselmouth.Sound(sys.argv[1])
found = sound.to_formant_burg(max_number_of_formants=5, maximum_formant=5000.0)
times = [sound.duration * (0.2 + 0.6 * i / 40) for i in range(41)]
medians = [statistics.median(found.get_value_at_time(k, t) for t in times) for k in (1, 2, 3, 4, 5)]
print(json.dumps([hz for hz in medians if hz == hz]))
