"""The words and units by which columns are known, all of them: what is not here says nothing.

Words are whole words, in lower case and without accents, their plural in s meant too. ``~temperatur`` also ends
longer ones (Raumtemperatur), ``aussen~`` also begins them: for languages that write compounds as one word. English,
German, French, Spanish, Italian, Dutch, Portuguese, Polish and Swedish.
"""

from __future__ import annotations

WORDS = {
    "time": "time timestamp stamp ts date datetime elapsed epoch t clock zeit ~zeitstempel datum uhrzeit ~zeitpunkt "
    "temps horodatage heure fecha hora tiempo tempo orario tijd tijdstip czas godzina tid tidpunkt dato "
    "klokkeslett",
    "calendar": "year yr yyyy month mo mon day dd doy jday julian yday dayofyear hour hr hh hhmm minute mn second "
    "sec seconds weekday week quarter dow jahr monat tag stunde annee mois jour ano mes dia anno mese giorno ora jaar "
    "maand dag uur rok miesiac dzien manad timme",
    "label": "anomaly anomalous changepoint fault faulty label class flag alarm truth mode status step indicator "
    "regime valid quality event qc qualifier mask outlier stale interpolated stufe modus ~storung ~fehler ~alarm "
    "defaut etat calidad estado alarma falla guasto stato qualita storing awaria larm fel",
    "counter": "index idx id no nr packet sample row rownames counter unnamed cycle record seq rec recnum obs "
    "lfd ~zyklus ~zahler stationsid stations",
    "logger": "battery batt battv bat rssi snr firmware serial uptime latitude longitude lat lon lng altitude "
    "elevation ~batterie",
    "computed": "total sum copy previous prev lag lagged lead avg mean average median diff difference residual "
    "error smoothed filtered scaled normalized norm delta cumulative cum summe kopie ~mittelwert differenz somme "
    "moyenne suma media somma soma som x1000 x100 x10",
    "setpoint": "setpoint sp set target reference ref desired soll~ ~sollwert consigne consigna setpunt borvarde "
    "zadana",
    "command": "u input inp command cmd control controller ctrl excitation actuator manipulated mv duty pwm op "
    "~stellgrosse stell~ ~stellwert ~stellung ~eingang commande entree comando entrada ingresso ~ingang sterowanie "
    "wejscie insignal opening setting gate",
    "device": "heater valve damper throttle pump fan brake steering drive actuator blower compressor burner chiller "
    "~ventil ~klappe ~pumpe ~heizung ~heizer ~lufter ~geblase ~drossel ~bremse pompe vanne ventilateur bomba valvula "
    "ventilador calefactor aquecedor pompa valvola ventola riscaldamento ~pomp ~klep ~ventilator ~verwarming grzalka "
    "zawor wentylator ~varmare ~flakt screw",
    "drive": "torque force moment power heating cooling aeration feed dose dosage influent inflow workload ~kraft "
    "~moment ~leistung ~zulauf ~zufluss ~last puissance chauffage couple alimentation potencia potenza coppia "
    "vermogen koppel moc effekt vridmoment potencial inspired price advertising promotion prix precio prezzo prijs "
    "preis~ tax subsidy dosering",
    "disturbance": "rain rainfall prec precip precipitation snowmelt melt snow evap evaporation evapotranspiration "
    "pet wind solar irradiance irradiation sun sunshine radiation ambient outdoor outside weather amb ta tamb toa "
    "forecast fc disturbance inlet river ~regen ~niederschlag ~verdunstung ~schmelze ~strahlung aussen~ ~sonne pluie "
    "precipitations rayonnement exterieur exterieure lluvia radiacion exterior precipitacion pioggia irraggiamento "
    "esterna esterno radiazione chuva externa externo radiacao ~neerslag buiten~ straling opad opady naslonecznienie "
    "zewnetrzna ~nederbord ute~ ~stralning evapo",
    "weather": "air luft~ aire aria ~powietrza lucht~",
    "source": "current strom corrente corriente courant stroom prad gas kms petrol",
    "output": "y output out response ist ~istwert measured measurement pv actual demand consumption sales revenue "
    "load ausgang ~ausgang sortie salida uscita saida uitgang wyjscie utsignal",
    "quantity": "temperature temp tmp ~temperatur speed velocity rpm position pos angle acceleration accel level "
    "head concentration composition heatload thermocouple displacement tachometer deflection soc outlet ph co co2 no2 "
    "nox o3 so2 nh3 methane benzene pm10 pm25 discharge runoff streamflow groundwater pressure humidity moisture "
    "oxygen turbidity conductivity thickness tension vibration unemployment inflation heart yield ~drehzahl "
    "~geschwindigkeit ~position ~lage winkel ~winkel ~beschleunigung ~fullstand ~pegel ~stand ~vorlauf ~rucklauf "
    "~druck ~feuchte ~abfluss ~ablauf ~dicke ~verbrauch temperatura ~temperatuur niveau vitesse debit pression "
    "humidite nivel velocidad presion caudal humedad posicion livello velocita portata pressione umidita posizione "
    "pressao umidade vazao posicao snelheid druk ~niveau vochtigheid poziom predkosc cisnienie wilgotnosc polozenie "
    "~niva hastighet tryck fuktighet lage",
    "voltage": "voltage tension ~spannung voltaje tensione spanning napiecie",
}

# Words of two axes by which a table says where a body is, and those of how it moves.
PLACES = "latitude longitude", "lat lon", "lat lng", "east north", "easting northing"
MOTION = (
    f"{' '.join(PLACES)} altitude alt elevation position pos speed velocity airspeed groundspeed mach climb sink "
    "vertical track course heading bearing yaw pitch roll bank turn acceleration accel gyro"
)

# What a column of that unit is more often, where its words say nothing.
UNITS = {
    "quantity": "°C °F K rpm 1/min tr/min pH m/s m/s² bpm",
    "source": "A W kW V % N kN Nm",
    "disturbance": "W/m²",
}

PLAIN_UNITS = (
    "V mV kV uV A mA uA W mW kW MW GW Wh kWh MWh Ah mAh Wm2 degC degF C F K Hz kHz MHz rpm m mm cm km um nm m2 "
    "m3 l L ml lpm kg g mg ug N kN Nm mNm bar mbar Pa kPa MPa hPa psi percent pct ppm ppb rad mrad deg mps kmh "
    "kph mph Ohm mOhm kOhm mF uF H mH mT lx lux lm dB dBm S mS uS J kJ MJ kcal mol mmol pH NTU s sec ms us ns "
    "min h hr hrs d day days seconds minutes hours Second Seconds Volt Volts Ampere Amps Hertz Watt tr bpm USD EUR GBP "
    "bit inch ft lb gal gpm"
)
"""Units as they are written in ASCII; with slashes, powers and dots between them, and ° % ² ³ µ Ω anywhere."""

WRITTEN = {
    "degC": "°C", "degF": "°F", "percent": "%", "pct": "%", "Wm2": "W/m²", "W/m2": "W/m²", "mps": "m/s", "degc": "°C",
    "Volt": "V", "Volts": "V", "Ampere": "A", "Amps": "A", "Hertz": "Hz", "Watt": "W",
    "deg C": "°C", "deg F": "°F", "℃": "°C", "Celsius": "°C", "m/s2": "m/s²", "m/s^2": "m/s²", "W/m^2": "W/m²",
    "m3/s": "m³/s", "m3/h": "m³/h", "U/min": "1/min", "lpm": "l/min",
}  # fmt: skip
"""One way to write a unit for each of the others."""

SECONDS = {
    "ns": 1e-9, "us": 1e-6, "µs": 1e-6, "ms": 1e-3, "s": 1.0, "sec": 1.0, "seconds": 1.0, "Second": 1.0,
    "Seconds": 1.0, "min": 60.0, "mins": 60.0,
    "minutes": 60.0, "h": 3600.0, "hr": 3600.0, "hrs": 3600.0, "hours": 3600.0, "d": 86400.0, "day": 86400.0,
    "days": 86400.0, "years": 365.25 * 86400.0,
}  # fmt: skip
"""Seconds of a unit of time."""
