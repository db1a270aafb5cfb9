class HeatAdjoint:
    def __init__(self,*a): pass
