"""What people call the columns of a record: plants in several languages, and names that say nothing."""

from __future__ import annotations

from typing import NamedTuple


class Theme(NamedTuple):
    """The names that one trade gives to outputs and inputs, each with its unit ("" for none).

    ``is_knowable``: whether a reader of the field knows cause from effect by names and units.
    """

    language: str
    outputs: tuple[tuple[str, str], ...]
    inputs: tuple[tuple[str, str], ...]
    is_knowable: bool = True


def _pairs(text: str) -> tuple[tuple[str, str], ...]:
    cells = [cell.strip().partition("|") for cell in text.split(";")]
    return tuple((name, unit) for name, _, unit in cells)


def _theme(language: str, outputs: str, inputs: str, is_knowable: bool = True) -> Theme:
    return Theme(language, _pairs(outputs), _pairs(inputs), is_knowable)


THEMES = (
    _theme("en", "room temperature|°C; wall temperature|°C",
           "heater power|W; outdoor temperature|°C; solar radiation|W/m2"),
    _theme("en", "speed|rpm; acceleration|m/s2", "motor voltage|V; load torque|Nm; throttle|%"),
    _theme("en", "tank level|cm; outlet flow|l/min", "pump|%; valve position|%; rainfall|mm"),
    _theme("en", "position|mm; velocity|mm/s", "force|N; control voltage|V; command|V"),
    _theme("en", "discharge|m3/s; groundwater level|m", "rain|mm; evapotranspiration|mm; snow melt|mm"),
    _theme("en", "terminal voltage|V; cell temperature|°C", "current|A; ambient temperature|°C; charge current|A"),
    _theme("en", "dissolved oxygen|mg/l; pH|", "aeration|m3/h; feed|l/h; influent flow|m3/h"),
    _theme("en", "sales|; revenue|USD", "advertising|USD; price|USD; promotion|"),
    _theme("en", "heart rate|bpm; oxygen uptake|ml/min", "workload|W; dose|mg; inspired oxygen|%"),
    _theme("en", "TempOut|degC; PressureOut|bar", "HeaterCmd|%; FanDuty|%; ValveOpening|%"),
    _theme("en", "T_supply|degC; T_return|degC", "u_valve|%; fan_speed_cmd|%; T_ambient|degC"),
    _theme("en", "electricity demand|MW; load|kW", "air temperature|°C; wind speed|m/s; solar irradiance|W/m2"),
    _theme("en", "y1|; y2|", "u1|; u2|; u3|"),
    _theme("en", "output|; output2|", "input|; input2|; input3|"),
    _theme("en", "thickness|um; strip tension|N", "roll gap setting|mm; roll force|kN; screw drive|%"),
    _theme("de", "Raumtemperatur|°C; Wandtemperatur|°C", "Heizleistung|W; Außentemperatur|°C; Globalstrahlung|W/m²"),
    _theme("de", "Drehzahl|1/min; Beschleunigung|m/s²", "Motorspannung|V; Lastmoment|Nm; Stellgröße|%"),
    _theme("de", "Füllstand|cm; Ablauf|l/min", "Pumpe|%; Ventilstellung|%; Zulauf|l/min"),
    _theme("de", "Abfluss|m³/s; Grundwasserstand|m", "Niederschlag|mm; Verdunstung|mm; Schneeschmelze|mm"),
    _theme("fr", "température ambiante|°C; température paroi|°C",
           "puissance chauffage|W; température extérieure|°C; rayonnement|W/m2"),
    _theme("fr", "niveau|cm; débit sortie|l/min", "pompe|%; vanne|%; pluie|mm"),
    _theme("fr", "vitesse|tr/min; position|mm", "tension moteur|V; couple|Nm; commande|%"),
    _theme("es", "temperatura interior|°C; temperatura pared|°C",
           "potencia calefactor|W; temperatura exterior|°C; radiación|W/m2"),
    _theme("es", "nivel|cm; caudal salida|l/min", "bomba|%; válvula|%; lluvia|mm"),
    _theme("it", "temperatura stanza|°C; temperatura parete|°C",
           "potenza riscaldamento|W; temperatura esterna|°C; irraggiamento|W/m2"),
    _theme("it", "livello|cm; portata uscita|l/min", "pompa|%; valvola|%; pioggia|mm"),
    _theme("nl", "kamertemperatuur|°C; waterstand|cm", "verwarming|%; buitentemperatuur|°C; neerslag|mm"),
    _theme("pt", "temperatura da sala|°C; nível|cm", "aquecedor|%; temperatura externa|°C; chuva|mm"),
    _theme("pl", "temperatura pokoju|°C; poziom|cm", "grzałka|%; zawór|%; opad|mm"),
    _theme("sv", "rumstemperatur|°C; nivå|cm", "värmare|%; ventil|%; nederbörd|mm"),
    # the unit alone tells
    _theme("en", "T1|°C; T2|°C", "Q1|W; Q2|W; Q3|W"),
    _theme("en", "sensor A|°C; sensor B|°C", "channel 1|V; channel 2|%; channel 3|W"),
    _theme("en", "S1|rpm; S2|rpm", "X1|V; X2|Nm; X3|%"),
    # nothing tells
    _theme("en", "ch1|; ch2|", "ch3|; ch4|; ch5|", False),
    _theme("en", "A|; B|", "C|; D|; E|", False),
    _theme("en", "signal_7|V; signal_2|V", "signal_4|V; signal_1|V; signal_9|V", False),
    _theme("en", "tag104|; tag131|", "tag107|; tag102|; tag118|", False),
)  # fmt: skip

CLOCK_WORDS = {
    "en": ("time", "timestamp", "date", "datetime", "Time"),
    "de": ("Zeit", "Zeitstempel", "Datum", "Datum/Uhrzeit"),
    "fr": ("temps", "horodatage", "date", "date et heure"),
    "es": ("tiempo", "fecha", "fecha y hora"),
    "it": ("tempo", "data", "data e ora"),
    "nl": ("tijd", "datum", "tijdstip"),
    "pt": ("tempo", "data", "data e hora"),
    "pl": ("czas", "data", "data i czas"),
    "sv": ("tid", "datum", "tidpunkt"),
}
