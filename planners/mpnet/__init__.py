"""Motion Planning Networks (Qureshi et al., ICRA 2019; T-RO 2020): imitation of demonstrations."""
