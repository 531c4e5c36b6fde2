simulate ev_driveline tip_out 'm=1200 kg'
