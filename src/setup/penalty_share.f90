!> Penalties of the tools on a face of the blank beside what the time step leaves for them.
module penalty_share
  use kinds, only: wp
  use input_errors, only: origin_t, error_list_t, add_warning
  use text, only: to_text, rounded_text
  use contact, only: scale_stiffness
  use contact_effect, only: contact_view_t, contact_pairs
  use model, only: model_t
  implicit none
  private

  public :: share_penalties

contains

  !> Let the penalties of all tools on a face together stay within what the step leaves: a penalty
  !! s m/dt^2 beside the blank's own frequency w is stable for (w dt)^2 + s <= 4, and w dt is twice
  !! the safety factor. A single tool is left as the deck wants it, with a warning. The greatest
  !! sum of a face is kept in the model.
  subroutine share_penalties(origin, model, errors)
    type(origin_t), intent(in) :: origin   !! of the pairs, for a warning
    type(model_t), intent(inout), target :: model
    type(error_list_t), intent(inout) :: errors
    type(contact_view_t), allocatable :: pairs(:)
    integer :: i

    pairs = contact_pairs(model%forces)
    do i = 1, size(pairs)
      call share_face(origin, pairs, i, model, errors)
    end do
  end subroutine share_penalties

  !> Share the penalty of all pairs of one face, if `first` is the first of them.
  subroutine share_face(origin, pairs, first, model, errors)
    type(origin_t), intent(in) :: origin
    type(contact_view_t), intent(in) :: pairs(:)    !! of the model
    integer, intent(in) :: first
    type(model_t), intent(inout), target :: model   ! which holds the pairs
    type(error_list_t), intent(inout) :: errors
    real(wp) :: shares(size(pairs)), limit, left, total
    logical :: is_there(size(pairs))
    integer :: i, step, n_tools

    shares = 0.0_wp
    do i = 1, size(pairs)
      associate (pair => pairs(i)%pair, face => pairs(first)%pair)
        if (pair%part /= face%part) cycle
        if (any(pair%lower /= face%lower .or. pair%upper /= face%upper)) cycle
        if (i < first) return
        shares(i) = pair%pair%share
      end associate
    end do
    left = max(0.0_wp, 4*(1 - model%step%safety**2))
    if (maxval(shares) > left) call add_warning(errors, origin, &
      "a penalty of "//rounded_text(maxval(shares))//" times mass over the square of the step", &
      "at most "//rounded_text(left)//", all that the safety factor "// &
      to_text(model%step%safety)//" leaves: beyond it contact may be unstable")
    limit = max(left, maxval(shares))
    total = 0.0_wp
    do step = 1, 1 + size(model%later_steps)
      is_there = [(pairs(i)%pair%first_step <= step .and. &
                   pairs(i)%pair%last_step >= step, i=1, size(pairs))]
      if (sum(shares, mask=is_there) <= total) cycle
      total = sum(shares, mask=is_there)
      n_tools = count(shares > 0.0_wp .and. is_there)
    end do
    model%penalty = max(model%penalty, min(total, limit))
    if (total <= limit) return
    do i = 1, size(pairs)
      if (shares(i) > 0.0_wp) call scale_stiffness(pairs(i)%pair%pair, limit/total)
    end do
    call add_warning(errors, origin, "penalties of "//to_text(n_tools)// &
                     " tools on one face that add up to "//rounded_text(total), &
                     "at most "//rounded_text(limit)//" with the scale factor "// &
                     rounded_text(model%step%safety)//"; they are scaled to that")
  end subroutine share_face

end module penalty_share
