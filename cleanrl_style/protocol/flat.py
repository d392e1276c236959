"""A network's parameters as one: clipping and Adam take one tensor, not each of a dozen small ones in turn."""


def flat_parameters(network):
    """One parameter, of one dimension, that holds all of the network's; they become parts of it, as their gradients of
    its own.

    Nothing is learned after what cuts them off: gradients set to None instead of zero, as `optimizer.zero_grad()` does
    unless it is told `set_to_none=False`, or a network that is moved, as by `agent.to(..)`.
    """
    import torch  # only here: the heuristics do without

    parameters = list(network.parameters())
    sizes = [parameter.numel() for parameter in parameters]
    flat = torch.nn.Parameter(torch.cat([parameter.detach().flatten() for parameter in parameters]))
    flat.grad = torch.zeros_like(flat)
    for parameter, data, gradient in zip(parameters, flat.detach().split(sizes), flat.grad.split(sizes), strict=True):
        parameter.data, parameter.grad = data.view_as(parameter), gradient.view_as(parameter)
    return flat
